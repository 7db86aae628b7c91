// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <orbis/io/detail/recordings/image_names.hpp>

#include "support/catch.hpp"

namespace io = orbis::io::detail;
using io::image_keys;
using paths = std::vector<std::filesystem::path>;

TEST_CASE("names of images are times, numbers, or neither") {
  const auto order = [](const paths& names) { return io::order_by_name(names); };
  CHECK(order({"10.png", "9.png", "0011.PNG"}).paths == paths{"9.png", "10.png", "0011.PNG"});
  CHECK(order({"10.png", "9.png"}).keys_are == image_keys::numbers);
  CHECK(order({"frame-000004.color.png", "frame-000002.color.png"}).keys == std::vector<double>{2, 4});
  CHECK(order({"0000000012.png", "0000000013.png"}).keys_are == image_keys::numbers);  // KITTI's raw data
  CHECK(order({"1.25.png", "10.5.png"}).keys_are == image_keys::times);
  CHECK(order({"rgb_1305031102.png", "rgb_1305031103.png"}).keys_are == image_keys::times);
  CHECK(order({"a1.png", "b1.png"}).keys_are == image_keys::alphabet);
  CHECK(order({"a.png", "b.png"}).keys == std::vector<double>{0, 1});
  CHECK(order({"1.png", "a.png"}).keys_are == image_keys::alphabet);
  // The form that most names have decides; others are left out.
  const auto most = order({"0.png", "1.png", "10.png", "2.png", "preview.png"});
  CHECK(most.paths == paths{"0.png", "1.png", "2.png", "10.png"});
  CHECK(most.others == paths{"preview.png"});
  // Seconds and nanoseconds, without and with leading zeros; seconds and microseconds.
  CHECK(order({"1311868164_119999999.png", "1311868164_20000000.png", "1311868165_5.png"}).keys ==
        std::vector<double>{1311868164.02, 1311868164.119999999, 1311868165.000000005});
  CHECK(order({"rgb-1311868164-119999999.png", "rgb-1311868164-020000000.png"}).keys ==
        std::vector<double>{1311868164.02, 1311868164.119999999});
  CHECK(order({"1311868164_020000.png", "1311868164_120000.png"}).keys ==
        std::vector<double>{1311868164.02, 1311868164.12});
  CHECK(order({"12345678901234567890.png"}).keys_are == image_keys::alphabet);  // no number, no time
  CHECK(order({}).paths.empty());
}

TEST_CASE("names are ordered by their times whatever surrounds these and in any unit") {
  std::mt19937 random{7};
  for (int trial = 0; trial != 40; ++trial) {
    const std::string before = std::vector<std::string>{"", "rgb_", "frame-", "cam0-image."}[random() % 4],
                      after = std::vector<std::string>{"", ".color", "_rgb", "-d"}[random() % 4];
    const int digits = std::vector<int>{10, 13, 16, 19}[random() % 4];
    const bool has_fraction = digits == 10 || random() % 2 == 0;
    std::vector<double> times;
    paths names;
    for (int i = 0; i != 5; ++i) {
      const std::uint64_t nanoseconds = 1305031102'000000000ULL + (random() % 1000) * 1'000'000ULL + 5000000000ULL * i;
      std::string text = std::to_string(nanoseconds);
      const std::string fraction = text.substr(static_cast<std::size_t>(digits));
      text.resize(static_cast<std::size_t>(digits));
      if (has_fraction) text += "." + fraction + "0";
      times.push_back(std::stod(std::to_string(nanoseconds / 1'000'000'000)) +
                      1e-9 * static_cast<double>(nanoseconds % 1'000'000'000));
      names.push_back(before + text + after + ".png");
    }
    std::shuffle(names.begin(), names.end(), random);
    const auto found = io::order_by_name(names);
    INFO(names.front().string());
    REQUIRE(found.keys_are == image_keys::times);
    CHECK(std::is_sorted(found.paths.begin(), found.paths.end()));
    for (std::size_t i = 0; i != times.size(); ++i) CHECK(std::abs(found.keys[i] - times[i]) < 1e-3);
  }
}
