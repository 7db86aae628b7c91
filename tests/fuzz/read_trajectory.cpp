// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a trajectory file, and as the text of one pose.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/trajectory_file.hpp>

#include "fuzz/target.hpp"

using namespace orbis;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  std::optional<result<trajectory>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(io::parse_trajectory(text, "fuzz.txt")); });
  fuzz::require(peak <= 8192 + 32 * size, "memory in proportion to the file");
  if (*got) {
    fuzz::accept();
    fuzz::require(std::is_sorted((*got)->begin(), (*got)->end(),
                                 [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; }),
                  "poses are in the order of time");
    for (const stamped_pose& p : **got) {
      fuzz::require(std::isfinite(p.timestamp) && p.T_world_camera.to_matrix().allFinite(), "poses are numbers");
      fuzz::require(std::abs(p.T_world_camera.rotation().unit_quaternion().norm() - 1.0) < 1e-9, "a rotation is one");
    }
  } else {
    fuzz::require(got->error().where.starts_with("fuzz.txt:"), "an error says where");
    fuzz::require(!got->error().message.empty() && got->error().message.size() < 200, "an error says why");
  }
  std::optional<result<io::trajectory_reading>> file;
  const std::size_t most = fuzz::peak_bytes_of([&] { file.emplace(io::parse_trajectory_file(text, "fuzz.txt")); });
  fuzz::require(most <= 8192 + 64 * size, "memory in proportion to the file, in any layout");
  if (*file) {
    fuzz::accept();
    const trajectory& poses = (*file)->poses;
    for (std::size_t i = 0; i != poses.size(); ++i) {
      fuzz::require(i == 0 || poses[i - 1].timestamp < poses[i].timestamp, "each time is there once");
      fuzz::require(std::isfinite(poses[i].timestamp) && poses[i].T_world_camera.to_matrix().allFinite(),
                    "lost poses are left out");
    }
    fuzz::require((*file)->notes.size() < 8, "many lines make few notes");
  } else {
    fuzz::require(file->error().where.starts_with("fuzz.txt"), "an error says where");
    fuzz::require(!file->error().message.empty() && file->error().message.size() < 300, "an error says why");
  }
  if (const auto pose = io::detail::parse_pose_matrix(text, "fuzz.txt"))
    fuzz::require(pose->to_matrix().allFinite(), "a pose is made of numbers");
  return 0;
}
