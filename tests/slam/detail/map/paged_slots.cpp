// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/map/paged_slots.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slots = slam::detail::paged_slots;

namespace {

/// What `tested` should say: all that it was told, except that it may have forgotten what was erased `remembered` ids
/// ago or earlier.
struct plain_slots {
  std::vector<std::uint32_t> slots;
  std::vector<std::uint32_t> erased_at;

  void add(std::uint32_t slot) {
    slots.push_back(slot);
    erased_at.push_back(static_cast<std::uint32_t>(slots.size()));
  }
  void erase(std::uint32_t i, std::uint32_t now) {
    slots[i] = now;
    erased_at[i] = static_cast<std::uint32_t>(slots.size());
  }
};

void check(const slots& tested, const plain_slots& plain, std::uint32_t remembered) {
  REQUIRE(tested.size() == plain.slots.size());
  std::uint32_t contained = tested.next_contained(0), known = tested.next_known(0);
  for (std::uint32_t i = 0; i != tested.size(); ++i) {
    const bool is_there = (plain.slots[i] & slots::erased) == 0;
    REQUIRE(tested.contains(i) == is_there);
    if (is_there || tested.size() - plain.erased_at[i] < remembered)
      REQUIRE(tested[i] == plain.slots[i]);
    else
      REQUIRE((tested[i] == plain.slots[i] || tested[i] == slots::gone));
    REQUIRE((contained == i) == is_there);
    if (contained == i) contained = tested.next_contained(i + 1);
    REQUIRE((known == i) == (tested[i] != slots::gone));
    if (known == i) known = tested.next_known(i + 1);
  }
  REQUIRE(contained == tested.size());
  REQUIRE(known == tested.size());
  std::uint32_t last = tested.size();
  while (last != 0 && !tested.contains(last - 1)) --last;
  REQUIRE(tested.last_contained() == (last == 0 ? tested.size() : last - 1));
  REQUIRE_FALSE(tested.contains(tested.size()));
}

}  // namespace

TEST_CASE("Slots are those that were given, and what was erased long ago is forgotten") {
  constexpr std::uint32_t remembered = 700;
  random_bits random(3);
  slots tested(remembered);
  plain_slots plain;
  std::vector<std::uint32_t> there;
  std::size_t forgotten = 0;
  for (std::uint32_t step = 0; step != 60000; ++step) {
    const std::uint32_t what = random.below(1000);
    if (what < 480 || there.empty()) {
      there.push_back(tested.size());
      tested.push_back(step);
      plain.add(step);
    } else if (what < 500) {
      tested.push_back(slots::erased | step);
      plain.add(slots::erased | step);
    } else if (what == 500) {
      const std::uint32_t count = random.below(2000);
      tested.push_gone(count);
      for (std::uint32_t i = 0; i != count; ++i) plain.add(slots::gone);
    } else {
      std::swap(there[random.below(static_cast<std::uint32_t>(there.size()))], there.back());
      const std::uint32_t now = random.below(2) == 0 ? slots::gone : slots::erased | step;
      tested.erase(there.back(), now);
      plain.erase(there.back(), now);
      there.pop_back();
    }
    if (step % 4000 == 0) check(tested, plain, remembered);
  }
  check(tested, plain, remembered);
  for (std::uint32_t i = 0; i != tested.size(); ++i) forgotten += tested[i] != plain.slots[i] ? 1U : 0U;
  CHECK(forgotten > 1000);

  slots copy = tested;
  const slots moved = std::move(tested);
  check(copy, plain, remembered);
  check(moved, plain, remembered);
  CHECK(tested.size() == 0);  // NOLINT: what a move leaves is defined
  CHECK(tested.next_contained(0) == 0);
  copy = moved;
  check(copy, plain, remembered);
}

TEST_CASE("Nothing is forgotten where all is to be remembered") {
  slots tested(slam::no_id);
  plain_slots plain;
  for (std::uint32_t i = 0; i != 5000; ++i) {
    tested.push_back(i);
    plain.add(i);
    tested.erase(i, slots::erased | 7U);
    plain.erase(i, slots::erased | 7U);
  }
  check(tested, plain, slam::no_id);
}

TEST_CASE("What is erased at once is remembered for as many ids as were asked for") {
  constexpr std::uint32_t remembered = 1000;
  slots tested(remembered);
  for (std::uint32_t i = 0; i != slots::page_size; ++i) tested.push_back(i);
  for (std::uint32_t i = 0; i != slots::page_size; ++i) tested.erase(i, slots::erased | 5U);
  for (std::uint32_t i = 1; i != remembered; ++i) {
    tested.push_back(i);
    REQUIRE(tested[0] == (slots::erased | 5U));
  }
  for (std::uint32_t i = 0; i != slots::page_size; ++i) tested.push_back(i);
  CHECK(tested[0] == slots::gone);
  CHECK(tested[slots::page_size - 1] == slots::gone);
  CHECK(tested[slots::page_size] == 1);
}

TEST_CASE("What was erased takes next to no memory, and what is there a page at most") {
  constexpr std::uint32_t remembered = 5000, every = 1000, ids = 3000000;
  slots tested(remembered);
  const std::size_t at_first = tested.memory_bytes();
  for (std::uint32_t i = 0; i != ids; ++i) {
    tested.push_back(i);
    if (i >= 300 && (i - 300) % every != 0) tested.erase(i - 300, slots::erased | 1U);
  }
  const std::size_t page = slots::page_size * sizeof(std::uint32_t) + 10;
  // Vectors may be twice as long as what is in them.
  CHECK(tested.memory_bytes() - at_first <
        2 * (page * (ids / every + (remembered + 600) / slots::page_size) + ids / 60));
  slots all_gone(remembered);
  for (std::uint32_t i = 0; i != ids; ++i) {
    all_gone.push_back(i);
    all_gone.erase(i, slots::gone);
  }
  CHECK(all_gone.memory_bytes() < 2 * (page * (remembered / slots::page_size + 2) + ids / 60));
}

TEST_CASE("What comes from elsewhere is remembered as long as what is erased here") {
  constexpr std::uint32_t remembered = 1000;
  slots tested(remembered);
  tested.adopt(true);
  for (std::uint32_t i = 0; i != 5000; ++i) tested.push_back(slots::erased | i);
  tested.adopt(false);
  for (std::uint32_t i = 0; i != remembered - slots::page_size; ++i) {
    tested.push_back(i);
    REQUIRE(tested[0] == slots::erased);
  }
  for (std::uint32_t i = 0; i != 2 * slots::page_size; ++i) tested.push_back(i);
  CHECK(tested[0] == slots::gone);
  CHECK(tested.last_contained() == tested.size() - 1);
}

TEST_CASE("Two thousand million ids that are gone are passed over in a moment") {
  slots tested(1000);
  tested.push_back(4);
  tested.push_gone(2000000000);
  tested.push_back(5);
  CHECK(tested.next_contained(1) == 2000000001);
  CHECK(tested.next_known(1) == 2000000001);
  CHECK(tested[2000000001] == 5);
  CHECK(tested[1000000000] == slots::gone);
  tested.erase(2000000001, slots::gone);
  CHECK(tested.last_contained() == 0);
  CHECK(tested.memory_bytes() < 200000);
}
