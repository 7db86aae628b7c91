// SPDX-License-Identifier: BSD-3-Clause
#include "octree/peers.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/files.hpp>

namespace orbis::bench {
namespace {

constexpr std::size_t frames_wanted = 64;

template <class Recording>
std::vector<scan> scans_of(const Recording& recording) {
  std::vector<scan> all;
  for (std::size_t i = 0; i != frames_wanted; ++i) {
    auto frame = recording.frame(i).value();
    all.push_back({std::move(frame.depth), frame.depth_scale, recording.camera().model, frame.T_world_camera.value()});
  }
  return all;
}

std::filesystem::path kitchen_folder() {
  const char* set = std::getenv("ORBIS_DATA_DIR");
  return std::filesystem::path{set != nullptr && *set != '\0' ? set : ORBIS_DATA_DIR} / "kitchen";
}

}  // namespace

std::vector<vec3f> scan::points() const {
  std::vector<vec3f> world;
  camera.visit([&](const auto& model) { octree::append_world_points(depth_metres(), model, T_world_camera, world); });
  return world;
}

const std::vector<scan>& room() {
  static const std::vector<scan> scans = scans_of(io::synthetic_recording{{.frames = 400}});
  return scans;
}
const std::vector<scan>& kitchen() {
  static const std::vector<scan> scans = scans_of(io::open_recording(kitchen_folder()).value());
  return scans;
}
bool have_kitchen() { return std::filesystem::exists(kitchen_folder()); }

octomap::Pointcloud to_octomap(const std::vector<vec3f>& points) {
  octomap::Pointcloud cloud;
  cloud.reserve(points.size());
  for (const vec3f& p : points) cloud.push_back(to_octomap(p));
  return cloud;
}
octomap::OcTree to_octomap(const map& m) {
  const silence octomap_reports;
  std::istringstream file{octree::ot_bytes(m)};
  const std::unique_ptr<octomap::AbstractOcTree> tree{octomap::AbstractOcTree::read(file)};
  return dynamic_cast<const octomap::OcTree&>(*tree);
}
std::string ot_of(const octomap::OcTree& tree) {
  const silence octomap_reports;
  std::ostringstream out;
  tree.write(out);
  return out.str();
}

const map& room_map(double resolution, int frames) {
  static std::map<std::pair<double, int>, std::unique_ptr<map>> made;
  auto& m = made[{resolution, frames}];
  if (m == nullptr) {
    m = std::make_unique<map>(resolution);
    for (int i = 0; i != frames; ++i) {
      const scan& s = room()[static_cast<std::size_t>(i)];
      m->integrate(s.points(), s.origin(), {.max_range = 5.0, .mode = octree::ray_mode::discretized});
    }
  }
  return *m;
}
const octomap::OcTree& room_octomap(double resolution, int frames) {
  static std::map<std::pair<double, int>, std::unique_ptr<octomap::OcTree>> made;
  auto& tree = made[{resolution, frames}];
  if (tree == nullptr) tree = std::make_unique<octomap::OcTree>(to_octomap(room_map(resolution, frames)));
  return *tree;
}

silence::silence() : kept_{dup(STDERR_FILENO)} {
  if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
    dup2(nowhere, STDERR_FILENO);
    close(nowhere);
  }
}
silence::~silence() {
  dup2(kept_, STDERR_FILENO);
  close(kept_);
}

std::string in_centimetres(double metres) { return std::to_string(std::lround(100.0 * metres)) + "cm"; }

}  // namespace orbis::bench
