// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/ros_images.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include <orbis/core/bytes.hpp>
#include <orbis/core/quote.hpp>
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

/// The encoding of the image before compression, as specified in the format.
std::string_view encoding_in(std::string_view format) { return format.substr(0, format.find(';')); }

/// OpenCV's conversion code for a Bayer mosaic or for colours shared by pairs of pixels (YUV 4:2:2).
std::optional<int> find_conversion(std::string_view encoding) {
  for (const auto& [name, code] :
       {std::pair{"bayer_rggb8", cv::COLOR_BayerRGGB2RGB}, std::pair{"bayer_bggr8", cv::COLOR_BayerBGGR2RGB},
        std::pair{"bayer_gbrg8", cv::COLOR_BayerGBRG2RGB}, std::pair{"bayer_grbg8", cv::COLOR_BayerGRBG2RGB},
        std::pair{"yuv422", cv::COLOR_YUV2RGB_UYVY}, std::pair{"uyvy", cv::COLOR_YUV2RGB_UYVY},
        std::pair{"yuv422_yuy2", cv::COLOR_YUV2RGB_YUY2}, std::pair{"yuyv", cv::COLOR_YUV2RGB_YUY2}})
    if (encoding == name) return code;
  return std::nullopt;
}

bool is_mosaic(std::string_view encoding) { return encoding.starts_with("bayer_"); }

/// Bytes per pixel of an encoding; 0 if it is not supported.
std::size_t bytes_per_pixel(std::string_view encoding) {
  for (const auto& [name, bytes] :
       {std::pair{"mono8", 1U}, std::pair{"8UC1", 1U}, std::pair{"rgb8", 3U}, std::pair{"bgr8", 3U},
        std::pair{"8UC3", 3U}, std::pair{"rgba8", 4U}, std::pair{"bgra8", 4U}, std::pair{"16UC1", 2U},
        std::pair{"mono16", 2U}, std::pair{"32FC1", 4U}})
    if (encoding == name) return bytes;
  return !find_conversion(encoding) ? 0 : is_mosaic(encoding) ? 1 : 2;
}

result<void> check_pixels(const ros_messages::image& m, const std::string& where) {
  const std::size_t bytes = bytes_per_pixel(m.encoding);
  if (bytes == 0)
    return fail(errc::unsupported, where, "the encoding " + orbis::shortened(m.encoding, 60) + " is not supported");
  if (m.width == 0 || m.height == 0 || m.width > 65536 || m.height > 65536 || m.step < m.width * bytes ||
      m.data.size() < std::size_t{m.step} * m.height)
    return fail(errc::malformed, where, "an image has fewer pixels than its size indicates");
  return {};
}

/// The stored value of a depth in metres; 0 if it is invalid or too large.
std::uint16_t to_stored(float z) {
  const double stored = std::isfinite(z) && z > 0.0F ? metres_scale * static_cast<double>(z) + 0.5 : 0.0;
  return stored < 65535.0 ? static_cast<std::uint16_t>(stored) : std::uint16_t{0};
}

/// A row of an image. @pre the image has enough pixels
const char* row_data(const ros_messages::image& m, int y) {
  return m.data.data() + std::size_t{m.step} * static_cast<std::size_t>(y);
}

}  // namespace

bool is_depth_encoding(std::string_view encoding) {
  const std::string_view of = encoding_in(encoding);
  return of == "16UC1" || of == "mono16" || of == "32FC1";
}
bool is_in_metres(std::string_view encoding) { return encoding_in(encoding) == "32FC1"; }
bool is_known_encoding(std::string_view encoding) { return bytes_per_pixel(encoding) != 0; }

result<color_image> decode_color(const ros_messages::image& m, const std::string& where) {
  if (auto ok = check_pixels(m, where); !ok) return fail(ok.error());
  if (is_depth_encoding(m.encoding)) return fail(errc::unsupported, where, "is a depth image, not a colour image");
  color_image out(static_cast<int>(m.width), static_cast<int>(m.height));
  if (const auto conversion = find_conversion(m.encoding)) {
    const bool mosaic = is_mosaic(m.encoding);
    if (mosaic && (m.width < 4 || m.height < 4))
      return fail(errc::malformed, where, "a Bayer mosaic must have at least 4x4 pixels");
    if (!mosaic && m.width % 2 != 0) return fail(errc::malformed, where, "a YUV 4:2:2 image must have an even width");
    const cv::Mat from(out.height(), out.width(), mosaic ? CV_8UC1 : CV_8UC2, const_cast<char*>(m.data.data()), m.step);
    cv::Mat to(out.height(), out.width(), CV_8UC3, out.data());
    cv::cvtColor(from, to, *conversion);
    return out;
  }
  const std::size_t bytes = bytes_per_pixel(m.encoding);
  const bool is_rgb = m.encoding.starts_with("rgb");
  for (int y = 0; y != out.height(); ++y) {
    const auto* p = reinterpret_cast<const std::uint8_t*>(row_data(m, y));
    for (int x = 0; x != out.width(); ++x, p += bytes)
      out(x, y) = bytes == 1 ? orbis::rgb8{*p, *p, *p}
                  : is_rgb   ? orbis::rgb8{p[0], p[1], p[2]}
                             : orbis::rgb8{p[2], p[1], p[0]};
  }
  return out;
}

result<color_image> decode_color(const ros_messages::compressed_image& m, const std::string& where) {
  const bool has_colors = contains(m.format, "compressed bgr") || contains(m.format, "compressed rgb");
  if (m.format.starts_with("bayer_") && !has_colors)
    return fail(errc::unsupported, where,
                "the encoding " + orbis::shortened(m.format, 60) + " of compressed images is not supported");
  if (orbis::io::is_png(m.data)) return orbis::io::decode_png_color(m.data, where);
  if (orbis::io::is_jpeg(m.data)) return orbis::io::decode_jpeg(m.data, where);
  return fail(errc::unsupported, where, "is neither PNG nor JPEG (format \"" + orbis::shortened(m.format, 60) + "\")");
}

result<depth_image> decode_depth(const ros_messages::image& m, const std::string& where) {
  if (auto ok = check_pixels(m, where); !ok) return fail(ok.error());
  if (!is_depth_encoding(m.encoding))
    return fail(errc::unsupported, where, "is not a depth image: its encoding is " + orbis::shortened(m.encoding, 60));
  const bool in_metres = is_in_metres(m.encoding);
  const std::endian order = m.is_bigendian != 0 ? std::endian::big : std::endian::little;
  depth_image out(static_cast<int>(m.width), static_cast<int>(m.height));
  for (int y = 0; y != out.height(); ++y) {
    const char* p = row_data(m, y);
    for (int x = 0; x != out.width(); ++x, p += in_metres ? 4 : 2)
      out(x, y) =
          in_metres ? to_stored(orbis::load_number<float>(p, order)) : orbis::load_number<std::uint16_t>(p, order);
  }
  return out;
}

result<depth_image> decode_depth(const ros_messages::compressed_image& m, const std::string& where) {
  constexpr std::size_t header = 12;  // the kind, and the two quantisation parameters
  const bool has_header = contains(m.format, "compressedDepth");
  std::string_view bytes = m.data;
  if (!is_depth_encoding(m.format) || contains(m.format, "rvl") || (is_in_metres(m.format) && !has_header))
    return fail(errc::unsupported, where,
                "compressed depth in the format \"" + orbis::shortened(m.format, 60) + "\" is not supported");
  if (has_header) bytes.remove_prefix(std::min(header, bytes.size()));
  if (!orbis::io::is_png(bytes))
    return fail(errc::malformed, where, "a compressed depth image does not contain a PNG image");
  auto out = orbis::io::decode_png_depth(bytes, where);
  if (!out || !is_in_metres(m.format)) return out;
  // The stored value is a / z + b.
  const auto a = orbis::load_number<float>(m.data.data() + 4), b = orbis::load_number<float>(m.data.data() + 8);
  if (!(a > 0.0F) || !std::isfinite(a) || !std::isfinite(b))
    return fail(errc::malformed, where, "the header of a compressed depth image has no scale");
  for (std::uint16_t& v : out->pixels()) v = v == 0 ? std::uint16_t{0} : to_stored(a / (static_cast<float>(v) - b));
  return out;
}

}  // namespace app
