// Bytes: a view of bytes that belong to somebody else, as std::span<const std::uint8_t> is, for
// programs in C++17 as well. A span converts to it, and it to a span.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace swarmtalk {

/// Bytes that belong to somebody else, who keeps them while this is used.
class Bytes {
 public:
  /// Of one of them.
  using value_type = std::uint8_t;

  constexpr Bytes() = default;
  /// Of `size` bytes at `data`.
  constexpr Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  /// Of an array.
  template <std::size_t kSize>
  constexpr Bytes(const std::uint8_t (&array)[kSize]) : data_(array), size_(kSize) {}
  /// Of a std::vector, std::array or std::span of std::uint8_t, or whatever has data() and size().
  template <
      typename Container,
      std::enable_if_t<
          std::is_convertible_v<decltype(std::declval<const Container&>().data()),
                                const std::uint8_t*> &&
              std::is_convertible_v<decltype(std::declval<const Container&>().size()), std::size_t>,
          int> = 0>
  constexpr Bytes(const Container& container) : data_(container.data()), size_(container.size()) {}

  /// The first.
  constexpr const std::uint8_t* data() const { return data_; }
  /// How many.
  constexpr std::size_t size() const { return size_; }
  /// Whether there is none.
  constexpr bool empty() const { return size_ == 0; }
  /// The first.
  constexpr const std::uint8_t* begin() const { return data_; }
  /// Behind the last.
  constexpr const std::uint8_t* end() const { return data_ + size_; }
  /// REQUIRES index < size()
  constexpr const std::uint8_t& operator[](std::size_t index) const { return data_[index]; }

 private:
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace swarmtalk
