// SPDX-License-Identifier: BSD-3-Clause
#ifdef RGBD_SLAM_BAG
#include "inputs/ros_images.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include <orbis/io/jpeg.hpp>
#include <orbis/io/png.hpp>

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;
using color_image = orbis::image<orbis::rgb8>;
using depth_image = orbis::image<std::uint16_t>;

bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// The encoding of the image before compression, from the format.
std::string_view encoding_in(std::string_view format) { return format.substr(0, format.find(';')); }

/// OpenCV's conversion code for a Bayer mosaic.
std::optional<int> mosaic_of(std::string_view encoding) {
  for (const auto& [name, code] :
       {std::pair{"bayer_rggb8", cv::COLOR_BayerRGGB2RGB}, std::pair{"bayer_bggr8", cv::COLOR_BayerBGGR2RGB},
        std::pair{"bayer_gbrg8", cv::COLOR_BayerGBRG2RGB}, std::pair{"bayer_grbg8", cv::COLOR_BayerGRBG2RGB}})
    if (encoding == name) return code;
  return std::nullopt;
}

/// Bytes per pixel of an encoding; 0 if it is not supported.
std::size_t bytes_of(std::string_view encoding) {
  for (const auto& [name, bytes] :
       {std::pair{"mono8", 1U}, std::pair{"8UC1", 1U}, std::pair{"rgb8", 3U}, std::pair{"bgr8", 3U},
        std::pair{"8UC3", 3U}, std::pair{"rgba8", 4U}, std::pair{"bgra8", 4U}, std::pair{"16UC1", 2U},
        std::pair{"mono16", 2U}, std::pair{"32FC1", 4U}})
    if (encoding == name) return bytes;
  return mosaic_of(encoding) ? 1 : 0;
}

result<void> check_pixels(const ros_messages::image& m, const std::string& where) {
  const std::size_t bytes = bytes_of(m.encoding);
  if (bytes == 0) return fail(errc::unsupported, where, "the encoding " + in_short(m.encoding) + " is not supported");
  if (m.width == 0 || m.height == 0 || m.width > 65536 || m.height > 65536 || m.step < m.width * bytes ||
      m.data.size() < std::size_t{m.step} * m.height)
    return fail(errc::malformed, where, "an image has fewer pixels than its size indicates");
  return {};
}

template <class T>
T read_as(const std::uint8_t* p, bool swap) {
  std::array<std::uint8_t, sizeof(T)> bytes;
  std::memcpy(bytes.data(), p, sizeof(T));
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

/// The stored value of a depth in metres; 0 if it is invalid or too large.
std::uint16_t stored_of(float z) {
  const double stored = std::isfinite(z) && z > 0.0F ? metres_scale * static_cast<double>(z) + 0.5 : 0.0;
  return stored < 65535.0 ? static_cast<std::uint16_t>(stored) : std::uint16_t{0};
}

std::string_view bytes_in(const ros_messages::compressed_image& m) {
  return {reinterpret_cast<const char*>(m.data.data()), m.data.size()};
}

}  // namespace

bool is_depth_encoding(std::string_view encoding) {
  const std::string_view of = encoding_in(encoding);
  return of == "16UC1" || of == "mono16" || of == "32FC1";
}
bool is_in_metres(std::string_view encoding) { return encoding_in(encoding) == "32FC1"; }
bool is_known_encoding(std::string_view encoding) { return bytes_of(encoding) != 0; }

result<color_image> color_of(const ros_messages::image& m, const std::string& where) {
  if (auto ok = check_pixels(m, where); !ok) return fail(ok.error());
  if (is_depth_encoding(m.encoding)) return fail(errc::unsupported, where, "is a depth image, not a colour image");
  color_image out(static_cast<int>(m.width), static_cast<int>(m.height));
  if (const auto mosaic = mosaic_of(m.encoding)) {
    if (m.width < 4 || m.height < 4)
      return fail(errc::malformed, where, "a Bayer mosaic must have at least 4x4 pixels");
    const cv::Mat from(out.height(), out.width(), CV_8UC1, const_cast<std::uint8_t*>(m.data.data()), m.step);
    cv::Mat to(out.height(), out.width(), CV_8UC3, out.data());
    cv::cvtColor(from, to, *mosaic);
    return out;
  }
  const std::size_t bytes = bytes_of(m.encoding);
  const bool is_rgb = m.encoding.starts_with("rgb");
  for (int y = 0; y != out.height(); ++y) {
    const std::uint8_t* p = m.data.data() + std::size_t{m.step} * static_cast<std::size_t>(y);
    for (int x = 0; x != out.width(); ++x, p += bytes)
      out(x, y) = bytes == 1 ? orbis::rgb8{*p, *p, *p}
                  : is_rgb   ? orbis::rgb8{p[0], p[1], p[2]}
                             : orbis::rgb8{p[2], p[1], p[0]};
  }
  return out;
}

result<color_image> color_of(const ros_messages::compressed_image& m, const std::string& where) {
  const std::string_view bytes = bytes_in(m);
  const bool has_colors = contains(m.format, "compressed bgr") || contains(m.format, "compressed rgb");
  if (m.format.starts_with("bayer_") && !has_colors)
    return fail(errc::unsupported, where,
                "the encoding " + in_short(m.format) + " of compressed images is not supported");
  if (orbis::io::is_png(bytes)) return orbis::io::decode_png_color(bytes, where);
  if (orbis::io::is_jpeg(bytes)) return orbis::io::decode_jpeg(bytes, where);
  return fail(errc::unsupported, where, "is neither PNG nor JPEG (format \"" + in_short(m.format) + "\")");
}

result<depth_image> depth_of(const ros_messages::image& m, const std::string& where) {
  if (auto ok = check_pixels(m, where); !ok) return fail(ok.error());
  if (!is_depth_encoding(m.encoding))
    return fail(errc::unsupported, where, "is not a depth image: its encoding is " + in_short(m.encoding));
  const bool in_metres = is_in_metres(m.encoding),
             swap = (m.is_bigendian != 0) == (std::endian::native == std::endian::little);
  depth_image out(static_cast<int>(m.width), static_cast<int>(m.height));
  for (int y = 0; y != out.height(); ++y) {
    const std::uint8_t* p = m.data.data() + std::size_t{m.step} * static_cast<std::size_t>(y);
    for (int x = 0; x != out.width(); ++x, p += in_metres ? 4 : 2)
      out(x, y) = in_metres ? stored_of(read_as<float>(p, swap)) : read_as<std::uint16_t>(p, swap);
  }
  return out;
}

result<depth_image> depth_of(const ros_messages::compressed_image& m, const std::string& where) {
  constexpr std::size_t header = 12;  // the kind, and the two quantisation parameters
  const bool has_header = contains(m.format, "compressedDepth");
  std::string_view bytes = bytes_in(m);
  if (!is_depth_encoding(m.format) || contains(m.format, "rvl") || (is_in_metres(m.format) && !has_header))
    return fail(errc::unsupported, where,
                "compressed depth in the format \"" + in_short(m.format) + "\" is not supported");
  if (has_header) bytes.remove_prefix(std::min(header, bytes.size()));
  if (!orbis::io::is_png(bytes)) return fail(errc::malformed, where, "a compressed depth image contains no PNG");
  auto out = orbis::io::decode_png_depth(bytes, where);
  if (!out || !is_in_metres(m.format)) return out;
  // The stored value is a / z + b.
  const bool swap = std::endian::native == std::endian::big;
  const float a = read_as<float>(m.data.data() + 4, swap), b = read_as<float>(m.data.data() + 8, swap);
  if (!(a > 0.0F) || !std::isfinite(a) || !std::isfinite(b))
    return fail(errc::malformed, where, "the header of a compressed depth image has no scale");
  for (std::uint16_t& v : out->pixels()) v = v == 0 ? std::uint16_t{0} : stored_of(a / (static_cast<float>(v) - b));
  return out;
}

}  // namespace app
#endif
