// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>
#include <vector>

#include <orbis/io/detail/time_stamp.hpp>

#include "support/catch.hpp"

namespace io = orbis::io::detail;
using Catch::Matchers::Contains;

TEST_CASE("the digits of a time stamp show its unit") {
  for (const auto& [text, seconds] :
       {std::pair{"1305031102.1753", 1305031102.1753}, std::pair{"1305031102", 1305031102.0},
        std::pair{"1305031102175", 1305031102.175}, std::pair{"1305031102175.25", 1305031102.17525},
        std::pair{"1418132416737115", 1418132416.737115}, std::pair{"1403636579763555584", 1403636579.763555584},
        std::pair{"1403636579763555584.000000", 1403636579.763555584}, std::pair{"12.5", 12.5}, std::pair{"0", 0.0},
        std::pair{"123456", 123456.0}, std::pair{"0000000000042", 42.0}, std::pair{"1.403715529e9", 1.403715529e9},
        std::pair{"-1305031102175", -1305031102175.0}}) {
    INFO(text);
    CHECK(std::abs(io::parse_time_stamp(text).value() - seconds) < 1e-6);
  }
  for (const char* const text : {"", "a", "1.5s", "nan", "inf", "1,5", "rgb/1.png"})
    CHECK_FALSE(io::parse_time_stamp(text));
}

TEST_CASE("whole numbers in small steps are frame numbers") {
  CHECK(io::are_frame_numbers({0, 1, 2, 3}));
  CHECK(io::are_frame_numbers({100, 105, 110, 190}));
  CHECK_FALSE(io::are_frame_numbers({0, 33, 67, 100}));          // milliseconds
  CHECK_FALSE(io::are_frame_numbers({0, 1, 1.5}));               // seconds
  CHECK_FALSE(io::are_frame_numbers({1305031102, 1305031103}));  // whole seconds since 1970
  CHECK_FALSE(io::are_frame_numbers({7}));
}

TEST_CASE("an interval far from the camera's names the likely unit") {
  const auto every = [](double interval) {
    std::vector<double> times;
    for (int i = 0; i != 20; ++i) times.push_back(1000.0 + interval * i);
    return times;
  };
  for (const double fps : {10.0, 30.0, 60.0})
    for (const double stride : {1.0, 2.0, 10.0}) {
      CHECK(io::describe_interval(every(stride / fps), fps).empty());
      for (const char* const factor : {"1000", "1000000", "1000000000"})
        if (stride == 1.0)
          CHECK_THAT(io::describe_interval(every(stride / fps * std::stod(factor)), fps),
                     Contains("seem to be " + std::string{factor} + " times too large"));
    }
  CHECK_THAT(io::describe_interval(every(62.5e-6), 16.0), Contains("6.25e-05 s") && Contains("check the unit"));
  CHECK(io::describe_interval({0.0, 1e9}, 30.0).empty());  // two frames show nothing
}
