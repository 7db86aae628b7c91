// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where octants are stored: a pool of records for each size of palette.
#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/octree/detail/storage/octant_record.hpp>

namespace orbis::octree::detail {

/// Records of octants, each known by a number: 3 bits for its pool, 29 for its place there. Pool p < 6 holds octants of
/// up to 2^p values, pool `plain` those of more. Copies share pages until one of them writes.
template <class T>
class octant_pools {
 public:
  static constexpr unsigned plain = max_palette_bits + 1;

  [[nodiscard]] static constexpr unsigned pool_of(std::uint32_t record) noexcept { return record >> 29U; }

  /// `use(record)`.
  template <class Use>
  decltype(auto) read(std::uint32_t record, Use&& use) const {
    return with_pool(*this, pool_of(record), [&](const auto& p) { return use(p.items[place_of(record)]); });
  }
  /// `use(record&)`, for writing.
  template <class Use>
  void write(std::uint32_t record, Use&& use) {
    with_pool(*this, pool_of(record), [&](auto& p) { use(p.items.writable(place_of(record))); });
  }
  /// A record that is not in use, from the pool with this number.
  [[nodiscard]] std::uint32_t add(unsigned number) {
    return number << 29U | with_pool(*this, number, [](auto& p) {
             if (p.free.empty()) {
               p.items.push_back({});
               return static_cast<std::uint32_t>(p.items.size() - 1);
             }
             const std::uint32_t place = p.free.back();
             p.free.pop_back();
             return place;
           });
  }
  void erase(std::uint32_t record) {
    with_pool(*this, pool_of(record), [&](auto& p) { p.free.push_back(place_of(record)); });
  }
  /// Bytes on the heap, those shared with copies included.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = 0;
    std::apply(
        [&](const auto&... p) { ((bytes += p.items.memory_bytes() + p.free.capacity() * sizeof(std::uint32_t)), ...); },
        pools_);
    return bytes;
  }

 private:
  template <class Record>
  struct pool {
    cow_pages<Record> items;
    std::vector<std::uint32_t> free;
  };

  [[nodiscard]] static constexpr std::uint32_t place_of(std::uint32_t record) noexcept { return record & 0x1fffffffU; }

  template <class Self, class Use>
  static decltype(auto) with_pool(Self& self, unsigned number, Use&& use) {
    switch (number) {
      case 0: return use(std::get<0>(self.pools_));
      case 1: return use(std::get<1>(self.pools_));
      case 2: return use(std::get<2>(self.pools_));
      case 3: return use(std::get<3>(self.pools_));
      case 4: return use(std::get<4>(self.pools_));
      case 5: return use(std::get<5>(self.pools_));
      default: return use(std::get<6>(self.pools_));
    }
  }

  std::tuple<pool<packed_octant<T, 0>>, pool<packed_octant<T, 1>>, pool<packed_octant<T, 2>>, pool<packed_octant<T, 3>>,
             pool<packed_octant<T, 4>>, pool<packed_octant<T, 5>>, pool<plain_octant<T>>>
      pools_;
};

}  // namespace orbis::octree::detail
