// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/ros_messages.hpp"

#include <algorithm>
#include <cmath>

#include <orbis/camera/plausible.hpp>
#include <orbis/core/quote.hpp>

#include "inputs/ros_images.hpp"

namespace app::ros_messages {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;

std::string frame_name(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  return std::string{name};
}

/// Reads a position and a quaternion (x, y, z, w).
orbis::se3 read_rigid(message_reader& in) {
  const auto v = in.array<double, 7>();
  const double norm = std::hypot(std::hypot(v[3], v[4]), std::hypot(v[5], v[6]));
  const bool is_pose = norm > 1e-3 && norm < 1e3 && std::ranges::all_of(v, [](double x) { return std::isfinite(x); });
  if (!is_pose) in.fail();
  if (!in.ok()) return {};
  return {orbis::so3{orbis::so3::quaternion(v[6], v[3], v[4], v[5])}, orbis::vec3{v[0], v[1], v[2]}};
}

}  // namespace

std::int64_t read_stamp(message_reader& in) {
  const bool is_ros1 = in.encoding() == message_encoding::ros1;
  if (is_ros1) in.skip(4);  // a sequence number
  const std::int64_t seconds = is_ros1 ? std::int64_t{in.number<std::uint32_t>()} : in.number<std::int32_t>();
  return seconds * 1'000'000'000 + in.number<std::uint32_t>();
}

void read(message_reader& in, header& m) {
  m.stamp = read_stamp(in);
  m.frame_id = frame_name(in.string());
}

void read(message_reader& in, image& m) {
  read(in, m.header);
  m.height = in.number<std::uint32_t>();
  m.width = in.number<std::uint32_t>();
  m.encoding = in.string();
  m.is_bigendian = in.number<std::uint8_t>();
  m.step = in.number<std::uint32_t>();
  m.data = in.bytes();
}

void read(message_reader& in, compressed_image& m) {
  read(in, m.header);
  m.format = in.string();
  m.data = in.bytes();
}

void read(message_reader& in, camera_info& m) {
  read(in, m.header);
  m.height = in.number<std::uint32_t>();
  m.width = in.number<std::uint32_t>();
  m.distortion_model = in.string();
  m.D = in.list<double>();
  m.K = in.array<double, 9>();
  m.R = in.array<double, 9>();
  m.P = in.array<double, 12>();
}

void read(message_reader& in, std::vector<transform>& m) {
  constexpr std::size_t least = 8 + 2 * 4 + 7 * 8;  // bytes of a transform with empty names
  m.resize(in.count(least));
  for (transform& t : m) {
    read(in, t.header);
    t.child_frame_id = frame_name(in.string());
    t.T_parent_child = read_rigid(in);
  }
}

void read_pose(message_reader& in, transform& m, bool has_child) {
  read(in, m.header);
  if (has_child) m.child_frame_id = frame_name(in.string());
  m.T_parent_child = read_rigid(in);
}

result<orbis::camera::any_camera> make_camera(const camera_info& info, bool is_rectified, const std::string& where) {
  if (info.width == 0 || info.height == 0 || info.width > 65536 || info.height > 65536)
    return fail(errc::malformed, where, "does not specify the image size: is the camera calibrated?");
  const auto width = static_cast<int>(info.width), height = static_cast<int>(info.height);
  const orbis::camera::intrinsics read =
      is_rectified && info.P[0] > 0.0
          ? orbis::camera::intrinsics{width, height, info.P[0], info.P[5], info.P[2], info.P[6]}
          : orbis::camera::intrinsics{width, height, info.K[0], info.K[4], info.K[2], info.K[5]};
  if (read.fx == 0.0 && read.fy == 0.0)
    return fail(errc::malformed, where, "has no camera matrix: is the camera calibrated?");
  const auto checked = orbis::camera::plausible(read, where);
  if (!checked) return fail(checked.error());
  const orbis::camera::intrinsics& k = *checked;
  const auto& d = info.D;
  if (!std::all_of(d.begin(), d.end(), [](double v) { return std::isfinite(v); }))
    return fail(errc::malformed, where, "has a distortion that is not finite");
  const bool is_straight = std::all_of(d.begin(), d.end(), [](double v) { return v == 0.0; });
  if (is_rectified || is_straight) return orbis::camera::any_camera{orbis::camera::pinhole{k}};
  const auto at = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  const std::string& model = info.distortion_model;
  if (model == "equidistant" && d.size() == 4)
    return orbis::camera::any_camera{orbis::camera::kannala_brandt{k, {d[0], d[1], d[2], d[3]}}};
  // The models of thin prisms and tilted sensors have 12 and 14 numbers. librealsense uses the name "Brown Conrady".
  const bool is_radial = model == "plumb_bob" || model == "Brown Conrady" || model == "rational_polynomial";
  const bool has_more = d.size() > 8 && std::any_of(d.begin() + 8, d.end(), [](double v) { return v != 0.0; });
  if (is_radial && d.size() >= 4 && !has_more)
    return orbis::camera::any_camera{
        orbis::camera::radial_tangential{k, {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)}}};
  return fail(
      errc::unsupported, where,
      "distortion model \"" + orbis::shortened(model, 60) + "\" with " + std::to_string(d.size()) +
          " coefficients is not supported (plumb_bob, rational_polynomial and equidistant are); specify a camera");
}

}  // namespace app::ros_messages
