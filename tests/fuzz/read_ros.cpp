// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a message of a ROS 1 bag: an image, a compressed image or a camera, as the first byte says; serialised
// as in a bag. Images are read as colour and as depth, cameras as those of rectified images and of others.
#include <cmath>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>

// For what it keeps to itself.
#include "fuzz/target.hpp"
#include "rgbd_slam/inputs/bag.cpp"

namespace {

using namespace orbis;

void check_error(const error& e) {
  fuzz::require(e.code == errc::malformed || e.code == errc::unsupported,
                "a damaged message is malformed or unsupported");
  fuzz::require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
}

/// The message that the bytes are; nothing where the library says that they are none.
template <class Message>
[[nodiscard]] std::optional<Message> message_of(const std::uint8_t* data, std::size_t size) try {
  std::optional<Message> m;
  const std::size_t peak = fuzz::peak_bytes_of([&] {
    // The library does not change what it reads.
    ros::serialization::IStream in{const_cast<std::uint8_t*>(data), static_cast<std::uint32_t>(size)};
    ros::serialization::deserialize(in, m.emplace());
  });
  fuzz::require(peak <= 8192 + 4 * size, "a message takes memory in proportion to its bytes");
  return m;
} catch (const std::exception&) {
  return std::nullopt;
}

template <class Read>
void check_image(Read&& read, std::size_t most_bytes) {
  std::optional<decltype(read())> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(read()); });
  fuzz::require(peak <= most_bytes, "an image takes memory in proportion to its message");
  if (!*got) return check_error(got->error());
  fuzz::require((*got)->width() > 0 && (*got)->height() > 0, "an image has pixels");
}

template <class Message>
void check_images(const std::uint8_t* data, std::size_t size, std::size_t most_bytes) {
  const auto m = message_of<Message>(data, size);
  if (!m) return;
  check_image([&] { return app::color_of(*m, "fuzz.bag"); }, most_bytes);
  check_image([&] { return app::depth_of(*m, "fuzz.bag"); }, most_bytes);
}

void check_camera(const std::uint8_t* data, std::size_t size) {
  const auto m = message_of<app::ros_messages::camera_info>(data, size);
  if (!m) return;
  for (const bool rectified : {false, true}) {
    const auto read = app::camera_of(*m, rectified, "fuzz.bag");
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
  const unsigned kind = data[0] % 3U;
  ++data, --size;
  // As they are, a byte may be a pixel of three; compressed, deflate makes 1032 bytes of one, and a bit may stand for a
  // pixel.
  if (kind == 0) check_images<app::ros_messages::image>(data, size, 8192 + 4 * size);
  if (kind == 1) check_images<app::ros_messages::compressed_image>(data, size, 8192 + 24 * (1032 * size + 1024));
  if (kind == 2) check_camera(data, size);
  return 0;
}
