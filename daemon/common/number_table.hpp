// NumberTable: a value for each 16-bit number (a channel's), found in two steps where a hash table
// would divide. Memory is taken for the 256 numbers around one that is used. Single-threaded.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

namespace swarmtalk::daemon {

template <class T>
class NumberTable {
 public:
  /// Made as T() when it is not there. Stays where it is.
  T& operator[](std::uint16_t number) {
    std::unique_ptr<Page>& page = pages_[number / kPage];
    if (page == nullptr) page = std::make_unique<Page>();
    return (*page)[number % kPage];
  }

  /// Null, or what operator[] would give.
  const T* find(std::uint16_t number) const {
    const std::unique_ptr<Page>& page = pages_[number / kPage];
    return page == nullptr ? nullptr : &(*page)[number % kPage];
  }

 private:
  static constexpr std::size_t kPage = 256;
  using Page = std::array<T, kPage>;

  std::array<std::unique_ptr<Page>, 65536 / kPage> pages_;
};

}  // namespace swarmtalk::daemon
