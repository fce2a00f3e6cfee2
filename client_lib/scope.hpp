// Scope: holds a value for a scope, also when a callback throws through it.
#pragma once

#include <utility>

namespace swarmtalk::client {

template <typename T>
class Scope {
 public:
  Scope(T& variable, T value) : variable_(variable), old_(std::exchange(variable, value)) {}
  ~Scope() { variable_ = old_; }
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;

 private:
  T& variable_;
  T old_;
};

}  // namespace swarmtalk::client
