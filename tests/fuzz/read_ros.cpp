// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a message of a ROS bag: the first byte says the kind (an image, a compressed image, a camera,
// transforms, a pose, odometry), and the encoding (ROS 1 or CDR). Images are read as colour and as depth, cameras as
// those of rectified images and of others.
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "fuzz/target.hpp"
#include "rgbd_slam/inputs/ros_images.hpp"
#include "rgbd_slam/inputs/ros_messages.hpp"

namespace {

using namespace orbis;
namespace ros = app::ros_messages;

void check_error(const error& e) {
  fuzz::require(e.code == errc::malformed || e.code == errc::unsupported,
                "a damaged message is malformed or unsupported");
  fuzz::require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
}

/// The message that the bytes are; empty if they are none.
template <class Message>
[[nodiscard]] std::optional<Message> message_of(std::string_view bytes, app::message_encoding encoding) {
  std::optional<Message> m;
  const std::size_t peak = fuzz::peak_bytes_of([&] {
    auto read = ros::parse<Message>(bytes, encoding, "fuzz.bag");
    if (read)
      m = *std::move(read);
    else
      check_error(read.error());
  });
  fuzz::require(peak <= 8192 + 8 * bytes.size(), "a message takes memory in proportion to its bytes");
  return m;
}

void check_pose(const se3& pose) {
  fuzz::accept();
  fuzz::require(pose.translation().allFinite(), "positions are numbers");
  fuzz::require(std::abs(pose.rotation().unit_quaternion().norm() - 1.0) < 1e-9, "rotations have norm one");
}

template <class Read>
void check_image(Read&& read, std::size_t most_bytes) {
  std::optional<decltype(read())> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(read()); });
  fuzz::require(peak <= most_bytes, "an image takes memory in proportion to its message");
  if (!*got) return check_error(got->error());
  fuzz::accept();
  fuzz::require((*got)->width() > 0 && (*got)->height() > 0, "an image has pixels");
}

template <class Message>
void check_images(std::string_view bytes, app::message_encoding encoding, std::size_t most_bytes) {
  const auto m = message_of<Message>(bytes, encoding);
  if (!m) return;
  check_image([&] { return app::decode_color(*m, "fuzz.bag"); }, most_bytes);
  check_image([&] { return app::decode_depth(*m, "fuzz.bag"); }, most_bytes);
}

void check_camera(std::string_view bytes, app::message_encoding encoding) {
  const auto m = message_of<ros::camera_info>(bytes, encoding);
  if (!m) return;
  for (const bool rectified : {false, true}) {
    const auto read = ros::make_camera(*m, rectified, "fuzz.bag");
    if (!read) {
      check_error(read.error());
      continue;
    }
    const camera::intrinsics& k = read->k();
    fuzz::require(k.width > 0 && k.height > 0 && k.fx > 0.0 && k.fy > 0.0, "an image has a size and a focal length");
    fuzz::require(std::isfinite(k.fx + k.fy + k.cx + k.cy), "intrinsics are numbers");
    fuzz::require(!rectified || read->model_name() == "pinhole", "rectified images have no distortion");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes{reinterpret_cast<const char*>(data) + 1, size - 1};
  const auto encoding = (data[0] & 8U) != 0 ? app::message_encoding::cdr : app::message_encoding::ros1;
  // As they are, a byte may be a pixel of three; compressed, deflate makes 1032 bytes of one, and a bit may stand for a
  // pixel.
  switch (data[0] % 8U) {
    case 0: check_images<ros::image>(bytes, encoding, 8192 + 4 * size); break;
    case 1: check_images<ros::compressed_image>(bytes, encoding, 8192 + 24 * (1032 * size + 1024)); break;
    case 2: check_camera(bytes, encoding); break;
    case 3:
      if (const auto m = message_of<std::vector<ros::transform>>(bytes, encoding))
        for (const ros::transform& t : *m) check_pose(t.T_parent_child);
      break;
    default: {
      app::message_reader in{bytes, encoding};
      ros::transform m;
      read_pose(in, m, data[0] % 8U == 4);
      if (in.ok()) check_pose(m.T_parent_child);
    }
  }
  return 0;
}
