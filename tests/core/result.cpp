// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A range that knows whether it is still alive.
struct watched {
  std::shared_ptr<bool> alive = std::make_shared<bool>(true);
  std::vector<int> numbers{1, 2, 3};
  watched() = default;
  watched(watched&& other) noexcept : alive{std::exchange(other.alive, nullptr)}, numbers{std::move(other.numbers)} {}
  ~watched() {
    if (alive) *alive = false;
  }
  [[nodiscard]] auto begin() const { return numbers.begin(); }
  [[nodiscard]] auto end() const { return numbers.end(); }
};

result<int> parse(const std::string& s) {
  if (s.empty()) return fail(errc::malformed, "file.txt:3", "is empty");
  return static_cast<int>(s.size());
}

result<std::string> passes_on(const std::string& s) {
  const auto n = parse(s);
  if (!n) return fail(n.error());
  return std::string(static_cast<std::size_t>(*n), 'x');
}

}  // namespace

TEST_CASE("a result holds a value or says what failed and where") {
  CHECK(parse("abc").value() == 3);
  CHECK(*parse("abc") == 3);
  const auto bad = passes_on("");
  REQUIRE(!bad);
  CHECK(bad.error().code == errc::malformed);
  CHECK(bad.error().to_string() == "file.txt:3: is empty");
  CHECK(error{errc::no_data, "", "nothing there"}.to_string() == "nothing there");
  CHECK_THROWS_AS(parse("").value(), tl::bad_expected_access<error>);
}

TEST_CASE("a range-for over the value of a temporary result does not outlive it") {
  std::weak_ptr<bool> alive;
  const auto open = [&]() -> result<watched> {
    watched w;
    alive = w.alive;
    return w;
  };
  int sum = 0;
  for (const int n : open().value()) {
    REQUIRE(!alive.expired());
    CHECK(*alive.lock());
    sum += n;
  }
  CHECK(sum == 6);
  CHECK(alive.expired());
  static_assert(std::is_same_v<decltype(std::declval<result<watched>>().value()), watched>);
  static_assert(std::is_same_v<decltype(*std::declval<result<watched>>()), watched>);
  static_assert(std::is_same_v<decltype(std::declval<result<watched>&>().value()), watched&>);
  static_assert(std::is_same_v<decltype(std::declval<const result<watched>&>().value()), const watched&>);
}

TEST_CASE("a result holds what can only be moved") {
  const auto make = []() -> result<std::unique_ptr<int>> { return std::make_unique<int>(5); };
  std::unique_ptr<int> p = make().value();
  CHECK(*p == 5);
  auto kept = make();
  CHECK(**kept == 5);
  CHECK(kept->get() != nullptr);
}

TEST_CASE("a result without a value is done or says why not") {
  const auto check = [](bool good) -> result<void> {
    if (!good) return fail(errc::write_failed, "x", "disk full");
    return {};
  };
  CHECK(check(true));
  CHECK(!check(false));
  CHECK(check(false).error().code == errc::write_failed);
}

TEST_CASE("every kind of failure has a name of its own") {
  std::vector<std::string_view> names;
  for (int c = 0; c <= static_cast<int>(errc::exception); ++c) names.push_back(to_string(static_cast<errc>(c)));
  for (std::size_t i = 0; i != names.size(); ++i) {
    CHECK(names[i] != "unknown");
    for (std::size_t j = 0; j != i; ++j) CHECK(names[i] != names[j]);
  }
}

TEST_CASE("a result without a value throws when it is asked for it") {
  const orbis::result<void> bad = orbis::fail(orbis::errc::malformed, "file", "damaged");
  CHECK_THROWS(bad.value());
  CHECK_NOTHROW(orbis::result<void>{}.value());
}
