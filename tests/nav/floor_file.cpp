// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <orbis/core/file.hpp>
#include <orbis/core/random.hpp>
#include <orbis/nav/floor_file.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

using namespace orbis;
using nav::floor_state;

namespace {

/// The keys of a flat YAML file, as text.
std::map<std::string, std::string> read_yaml(const std::filesystem::path& path) {
  std::map<std::string, std::string> values;
  std::ifstream in{path};
  for (std::string line; std::getline(in, line);) {
    const auto colon = line.find(": ");
    REQUIRE(colon != std::string::npos);
    values[line.substr(0, colon)] = line.substr(colon + 2);
  }
  return values;
}

}  // namespace

TEST_CASE("A floor map's files are read back by the map server's rule") {
  const test::temporary_folder dir;
  random_bits random{1};
  nav::floor_map floor;
  floor.resolution = 0.05;
  floor.origin = vec2{-3.35, 1.0 / 3.0};
  floor.states = image<floor_state>(37, 21);
  for (floor_state& s : floor.states.pixels()) s = static_cast<floor_state>(random.below(3));
  const auto path = dir / "a floor.yaml";
  REQUIRE(nav::save_floor_map(path, floor).has_value());

  auto yaml = read_yaml(path);
  CHECK(yaml.size() == 7);
  CHECK(yaml["image"] == "\"a floor.pgm\"");
  CHECK(yaml["mode"] == "trinary");
  CHECK(yaml["negate"] == "0");
  CHECK(std::strtod(yaml["resolution"].c_str(), nullptr) == 0.05);
  double x = 0, y = 0, yaw = 1;
  REQUIRE(std::sscanf(yaml["origin"].c_str(), "[%lf, %lf, %lf]", &x, &y, &yaw) == 3);
  CHECK(x == floor.origin.x());
  CHECK(y == floor.origin.y());
  CHECK(yaw == 0.0);
  const double occupied_above = std::strtod(yaml["occupied_thresh"].c_str(), nullptr);
  const double free_below = std::strtod(yaml["free_thresh"].c_str(), nullptr);

  std::istringstream in{read_file(dir / "a floor.pgm").value()};
  std::string magic;
  int width = 0, height = 0, most = 0;
  in >> magic >> width >> height >> most;
  REQUIRE(magic == "P5");
  REQUIRE(width == 37);
  REQUIRE(height == 21);
  REQUIRE(most == 255);
  in.get();
  for (int row = 0; row != height; ++row)
    for (int column = 0; column != width; ++column) {
      const double occupancy = (255 - in.get()) / 255.0;
      const floor_state state = occupancy > occupied_above ? floor_state::occupied
                                : occupancy < free_below   ? floor_state::free
                                                           : floor_state::unknown;
      REQUIRE(state == floor.states(column, height - 1 - row));
    }
  CHECK(in.peek() == std::istringstream::traits_type::eof());

  CHECK(nav::save_floor_map(dir / "floor.pgm", floor).error().code == errc::invalid_argument);
  CHECK(nav::save_floor_map(dir / "a \"floor\".yaml", floor).error().code == errc::invalid_argument);
  CHECK(nav::save_floor_map(dir / "none" / "floor.yaml", floor).error().code == errc::write_failed);
  CHECK(nav::save_floor_map("", floor).error().code == errc::invalid_argument);
  const auto refused = [&](const nav::floor_map& bad) {
    return nav::save_floor_map(dir / "bad.yaml", bad).error().code == errc::invalid_argument &&
           !std::filesystem::exists(dir / "bad.pgm");
  };
  CHECK(refused(nav::floor_map{}));
  nav::floor_map nowhere = floor, without_size = floor;
  nowhere.origin.x() = std::nan("");
  without_size.resolution = 0.0;
  CHECK(refused(nowhere));
  CHECK(refused(without_size));
}
