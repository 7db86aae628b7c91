// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Storage of octants of 4x4x4 voxels: the distinct values, and for each voxel the index of its value. The records are
/// in pools, one per palette size.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>

namespace orbis::octree::detail {

/// A stored octant: its known voxels, and the indices of their values as bit planes.
template <class T>
struct octant_view {
  std::uint64_t known = 0;
  const std::uint64_t* plane = nullptr;  ///< `bits` masks: mask j holds bit j of every voxel's index
  unsigned bits = 0;
  const T* value = nullptr;

  /// Value of the voxel at a place. @pre the voxel is known
  [[nodiscard]] T at(std::uint32_t place) const noexcept {
    unsigned index = 0;
    for (unsigned j = 0; j != bits; ++j) index |= static_cast<unsigned>(plane[j] >> place & 1U) << j;
    return value[index];
  }
};

/// An octant with up to 2^Bits distinct values.
template <class T, unsigned Bits>
struct packed_octant {
  std::uint64_t known = 0;
  std::array<std::uint64_t, Bits> plane{};
  std::array<T, 1U << Bits> values{};

  [[nodiscard]] octant_view<T> view() const noexcept { return {known, plane.data(), Bits, values.data()}; }
  [[nodiscard]] T at(std::uint32_t place) const noexcept {
    unsigned index = 0;
    for (unsigned j = 0; j != Bits; ++j) index |= static_cast<unsigned>(plane[j] >> place & 1U) << j;
    return values[index];
  }
  template <class Wanted>
  [[nodiscard]] std::uint64_t where(Wanted&& wanted) const noexcept {
    std::uint64_t found = 0;
    for (unsigned i = 0; i != 1U << Bits; ++i)
      if (wanted(values[i])) found |= voxels_of_index<Bits>(plane.data(), i);
    return found;
  }
  void unpack(block<T>& out) const noexcept {
    out.known = known;
    expand_palette(values.data(), plane.data(), Bits, out);
  }
  void pack(std::uint64_t voxels, const palette<T>& p) noexcept {
    known = voxels;
    std::copy_n(p.plane.begin(), Bits, plane.begin());
    std::copy_n(p.value.begin(), values.size(), values.begin());
  }
  template <class Change>
  [[nodiscard]] packed_octant transformed(Change&& change, std::uint64_t& different) const {
    packed_octant changed = *this;
    for (unsigned i = 0; i != 1U << Bits; ++i) {
      const std::uint64_t where = known & voxels_of_index<Bits>(plane.data(), i);
      if (where == 0) continue;
      const std::optional<T> v = change(values[i]);
      if (v != values[i]) different |= where;
      if (v) changed.values[i] = *v;
      if (!v) changed.known &= ~where;
    }
    return changed;
  }
};
/// Bit p of mask j is bit j of place p.
inline constexpr std::array<std::uint64_t, 6> place_planes{0xaaaaaaaaaaaaaaaa, 0xcccccccccccccccc, 0xf0f0f0f0f0f0f0f0,
                                                           0xff00ff00ff00ff00, 0xffff0000ffff0000, 0xffffffff00000000};
/// An octant with more distinct values than palettes can hold.
template <class T>
struct plain_octant {
  std::uint64_t known = 0;
  std::array<T, 64> values{};

  [[nodiscard]] octant_view<T> view() const noexcept { return {known, place_planes.data(), 6, values.data()}; }
  [[nodiscard]] T at(std::uint32_t place) const noexcept { return values[place]; }
  template <class Wanted>
  [[nodiscard]] std::uint64_t where(Wanted&& wanted) const noexcept {
    std::uint64_t found = 0;
    for (unsigned i = 0; i != 64; ++i) found |= std::uint64_t{wanted(values[i])} << i;
    return found;
  }
  void unpack(block<T>& out) const noexcept {
    out.known = known;
    out.value = values;
  }
  void pack(const block<T>& voxels) noexcept {
    known = voxels.known;
    values = voxels.value;
  }
  template <class Change>
  [[nodiscard]] plain_octant transformed(Change&& change, std::uint64_t& different) const {
    plain_octant changed = *this;
    for (std::uint64_t rest = known; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(rest));
      const std::optional<T> v = change(values[i]);
      if (v != values[i]) different |= std::uint64_t{1} << i;
      changed.values[i] = v.value_or(T{});
      if (!v) changed.known &= ~(std::uint64_t{1} << i);
    }
    return changed;
  }
};

/// Records of octants, identified by 3 bits for the pool and 29 for the position in it. Pool p < 6 holds octants with
/// up to 2^p distinct values, pool `plain` those with more. Copies share pages until one of them is modified.
template <class T>
class octant_pools {
 public:
  static constexpr unsigned plain = max_palette_bits + 1;

  [[nodiscard]] static constexpr unsigned pool_number(std::uint32_t record) noexcept { return record >> 29U; }

  /// Calls `use(record)`.
  template <class Use>
  decltype(auto) read(std::uint32_t record, Use&& use) const {
    return with_pool(*this, pool_number(record), [&](const auto& p) { return use(p.items[place_in_pool(record)]); });
  }
  /// Calls `use(record&)`, for writing.
  template <class Use>
  void write(std::uint32_t record, Use&& use) {
    with_pool(*this, pool_number(record), [&](auto& p) { use(p.items.writable(place_in_pool(record))); });
  }
  /// Returns an unused record of pool `number`.
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
    with_pool(*this, pool_number(record), [&](auto& p) { p.free.push_back(place_in_pool(record)); });
  }
  /// Heap memory in bytes, including memory shared with copies.
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

  [[nodiscard]] static constexpr std::uint32_t place_in_pool(std::uint32_t record) noexcept {
    return record & 0x1fffffffU;
  }

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
