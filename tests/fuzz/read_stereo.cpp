// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as the files of stereo recordings: settings of a camera, lists, calibrations and poses.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/io/detail/recordings/asl.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>

#include "fuzz/target.hpp"

using namespace orbis;

namespace {

/// Whether memory stays in proportion, and what is wrong is said in words.
template <class Parse>
auto checked(std::string_view text, Parse&& parse) {
  std::optional<decltype(parse())> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(parse()); });
  fuzz::require(peak <= 65536 + 512 * text.size(), "memory in proportion to the file");
  if (!*got) {
    fuzz::require(got->error().where.starts_with("fuzz.txt"), "an error says where");
    fuzz::require(!got->error().message.empty(), "an error says why");
  } else {
    fuzz::accept();
  }
  return *std::move(got);
}

bool is_rotation(const se3& pose) {
  return pose.translation().allFinite() && std::abs(pose.rotation().unit_quaternion().norm() - 1.0) < 1e-9;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  const char* const where = "fuzz.txt";
  if (const auto camera = checked(text, [&] { return io::detail::parse_asl_camera(text, where); })) {
    const camera::intrinsics& k = camera->model.k();
    fuzz::require(k.width > 0 && k.height > 0 && camera::is_valid(k), "an image has a size and a focal length");
    fuzz::require(is_rotation(camera->T_body_camera) && camera->rate > 0.0, "a camera has a place and a rate");
  }
  if (const auto k = checked(text, [&] { return io::detail::parse_kitti_calibration(text, 0, 1, where); }))
    fuzz::require(k->fx > 0.0 && k->fy > 0.0 && k->baseline > 0.0 && std::isfinite(k->baseline),
                  "a pair has a baseline");
  if (const auto times = checked(text, [&] { return io::detail::parse_times(text, where); }))
    for (std::size_t i = 1; i < times->size(); ++i) fuzz::require((*times)[i] > (*times)[i - 1], "times ascend");
  if (const auto poses = checked(text, [&] { return io::detail::parse_kitti_poses(text, where); }))
    for (const std::optional<se3>& pose : *poses) fuzz::require(!pose || is_rotation(*pose), "a pose is rigid");
  if (const auto poses = checked(text, [&] { return io::detail::parse_asl_poses(text, where); }))
    for (const stamped_pose& p : poses->poses) fuzz::require(is_rotation(p.T_world_camera), "a pose is rigid");
  std::vector<std::string> notes;
  if (const auto list = checked(text, [&] { return io::detail::parse_image_list(text, where, "data", notes); }))
    fuzz::require(!list->empty(), "a list that is read names images");
  fuzz::require(notes.size() < 20, "many lines make few notes");
  return 0;
}
