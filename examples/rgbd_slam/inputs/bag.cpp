// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/file_recording.hpp"

#ifdef RGBD_SLAM_BAG
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <orbis/camera/stereo.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/jpeg.hpp>
#include <orbis/io/png.hpp>

#include "inputs/ros_messages.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;
using color_image = orbis::image<orbis::rgb8>;
using depth_image = orbis::image<std::uint16_t>;

/// Of depth in metres: a fifth of a millimetre, up to 13 m.
constexpr double metres_scale = 5000.0;

/// Bytes of each pixel of an encoding; zero if we do not read it.
std::size_t bytes_of(std::string_view encoding) {
  for (const auto& [name, bytes] :
       {std::pair{"mono8", 1U}, std::pair{"8UC1", 1U}, std::pair{"rgb8", 3U}, std::pair{"bgr8", 3U},
        std::pair{"8UC3", 3U}, std::pair{"rgba8", 4U}, std::pair{"bgra8", 4U}, std::pair{"16UC1", 2U},
        std::pair{"mono16", 2U}, std::pair{"32FC1", 4U}})
    if (encoding == name) return bytes;
  return 0;
}
bool is_depth_encoding(std::string_view encoding) {
  return encoding == "16UC1" || encoding == "mono16" || encoding == "32FC1";
}

/// Errors: malformed, if a message has not the pixels that it says it has.
result<void> check_pixels(const ros_messages::image& m, const std::string& where) {
  const std::size_t bytes = bytes_of(m.encoding);
  if (bytes == 0) return fail(errc::unsupported, where, "images in the encoding " + m.encoding + " are not read");
  if (m.width == 0 || m.height == 0 || m.width > 65536 || m.height > 65536 || m.step < m.width * bytes ||
      m.data.size() < std::size_t{m.step} * m.height)
    return fail(errc::malformed, where, "an image has fewer pixels than its size says");
  return {};
}

result<color_image> color_of(const ros_messages::image& m, const std::string& where) {
  if (auto ok = check_pixels(m, where); !ok) return fail(ok.error());
  if (is_depth_encoding(m.encoding)) return fail(errc::unsupported, where, "is depth, and no colour image");
  const std::size_t bytes = bytes_of(m.encoding);
  const bool is_rgb = m.encoding.starts_with("rgb");
  color_image out(static_cast<int>(m.width), static_cast<int>(m.height));
  for (int y = 0; y != out.height(); ++y) {
    const std::uint8_t* p = m.data.data() + std::size_t{m.step} * static_cast<std::size_t>(y);
    for (int x = 0; x != out.width(); ++x, p += bytes)
      out(x, y) = bytes == 1 ? orbis::rgb8{*p, *p, *p}
                  : is_rgb   ? orbis::rgb8{p[0], p[1], p[2]}
                             : orbis::rgb8{p[2], p[1], p[0]};
  }
  return out;
}

template <class T>
T read_as(const std::uint8_t* p, bool swap) {
  std::array<std::uint8_t, sizeof(T)> bytes;
  std::memcpy(bytes.data(), p, sizeof(T));
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

/// Metres become fifths of a millimetre; whole numbers stay.
result<depth_image> depth_of(const ros_messages::image& m, const std::string& where) {
  if (auto ok = check_pixels(m, where); !ok) return fail(ok.error());
  if (!is_depth_encoding(m.encoding))
    return fail(errc::unsupported, where, "is no depth image: its encoding is " + m.encoding);
  const bool in_metres = m.encoding == "32FC1",
             swap = (m.is_bigendian != 0) == (std::endian::native == std::endian::little);
  depth_image out(static_cast<int>(m.width), static_cast<int>(m.height));
  for (int y = 0; y != out.height(); ++y) {
    const std::uint8_t* p = m.data.data() + std::size_t{m.step} * static_cast<std::size_t>(y);
    for (int x = 0; x != out.width(); ++x, p += in_metres ? 4 : 2) {
      if (!in_metres) {
        out(x, y) = read_as<std::uint16_t>(p, swap);
        continue;
      }
      const float z = read_as<float>(p, swap);
      const double stored = std::isfinite(z) && z > 0.0F ? metres_scale * z + 0.5 : 0.0;
      out(x, y) = stored < 65535.0 ? static_cast<std::uint16_t>(stored) : std::uint16_t{0};
    }
  }
  return out;
}

/// The camera of `info`. `rectified`: of images that have been rectified.
result<orbis::camera::any_camera> camera_of(const ros_messages::camera_info& info, bool rectified,
                                            const std::string& where) {
  const auto width = static_cast<int>(info.width), height = static_cast<int>(info.height);
  const orbis::camera::intrinsics k =
      rectified && info.P[0] > 0.0
          ? orbis::camera::intrinsics{width, height, info.P[0], info.P[5], info.P[2], info.P[6]}
          : orbis::camera::intrinsics{width, height, info.K[0], info.K[4], info.K[2], info.K[5]};
  if (!orbis::camera::is_valid(k))
    return fail(errc::malformed, where, "has no camera matrix: is the camera calibrated?");
  const auto& d = info.D;
  const bool is_straight = std::all_of(d.begin(), d.end(), [](double v) { return v == 0.0; });
  if (rectified || is_straight) return orbis::camera::any_camera{orbis::camera::pinhole{k}};
  const auto at = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  if (info.distortion_model == "equidistant" && d.size() == 4)
    return orbis::camera::any_camera{orbis::camera::kannala_brandt{k, {d[0], d[1], d[2], d[3]}}};
  if ((info.distortion_model == "plumb_bob" || info.distortion_model == "rational_polynomial") && d.size() >= 4 &&
      d.size() <= 8)
    return orbis::camera::any_camera{
        orbis::camera::radial_tangential{k, {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)}}};
  return fail(errc::unsupported, where,
              "distortion model \"" + info.distortion_model + "\" with " + std::to_string(d.size()) +
                  " numbers is not one of plumb_bob, rational_polynomial, equidistant");
}

/// The messages of a topic.
struct topic {
  std::string name, type, encoding;  ///< encoding: of the first image
  std::vector<double> times;         ///< of their headers, ascending
  std::vector<rosbag::MessageInstance> messages;
  [[nodiscard]] bool is_depth() const { return is_depth_encoding(encoding); }
};

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

/// Whether two topics are those of a left and a right camera.
bool is_pair(const std::string& left, const std::string& right) {
  for (const auto& [l, r] : {std::pair{"left", "right"}, std::pair{"cam0", "cam1"}, std::pair{"infra1", "infra2"},
                             std::pair{"camera_0", "camera_1"}, std::pair{"camera0", "camera1"}}) {
    std::string other = left;
    const std::size_t at = other.find(l);
    if (at == std::string::npos) continue;
    other.replace(at, std::string_view{l}.size(), r);
    if (other == right) return true;
  }
  return false;
}

class bag_recording final : public file_recording {
 public:
  bag_recording() { kind = "ROS bag"; }

  result<void> open(const std::filesystem::path& path, const file_recording_options& options) {
    path_ = path.string();
    files = {path};
    try {
      bag_.open(path_, rosbag::bagmode::Read);
      return set_up(options);
    } catch (const std::exception& e) {  // of the library: not a bag, or a damaged one
      return fail(errc::malformed, path_, std::string{"is no ROS 1 bag that can be read: "} + e.what());
    }
  }
  [[nodiscard]] std::size_t size() const override { return frames_.size(); }
  [[nodiscard]] result<source_frame> frame(std::size_t i) const override {
    const std::lock_guard lock{mutex_};
    auto first = read_color(*first_, frames_[i].first);
    if (!first) return fail(first.error());
    source_frame f;
    f.timestamp = first_->times[frames_[i].first];
    f.depth_scale = camera.depth_scale;
    f.color = straight_ ? straight_->left().bilinear(first->view()) : *std::move(first);
    if (sensor == orbis::slam::sensor_kind::rgbd) {
      auto depth = read_depth(frames_[i].second);
      if (!depth) return fail(depth.error());
      f.depth = *std::move(depth);
    } else if (sensor == orbis::slam::sensor_kind::stereo) {
      auto second = read_color(*second_, frames_[i].second);
      if (!second) return fail(second.error());
      f.right = straight_ ? straight_->right().bilinear(second->view()) : *std::move(second);
    }
    return f;
  }
  [[nodiscard]] result<color_image> color(std::size_t i) const override {
    const std::lock_guard lock{mutex_};
    auto first = read_color(*first_, frames_[i].first);
    if (first && straight_) return straight_->left().bilinear(first->view());
    return first;
  }

 private:
  [[nodiscard]] std::string where(const topic& of) const { return path_ + " " + of.name; }

  result<void> set_up(const file_recording_options& options) {
    list_topics();
    if (auto chosen = choose(options); !chosen) return chosen;
    for (topic* t : {first_, second_})
      if (t != nullptr) read_times(*t);
    pair_frames();
    if (frames_.empty())
      return fail(errc::no_data, path_,
                  second_ == nullptr
                      ? "no image in " + first_->name
                      : "no image of " + first_->name + " has a partner in " + second_->name + " at its time");
    notes.push_back("images of " + first_->name + (second_ != nullptr ? " and " + second_->name : ""));
    if (auto known = find_camera(options); !known) return known;
    if (auto fits = frame(0); !fits) return fail(fits.error());
    return {};
  }

  void list_topics() {
    rosbag::View all{bag_};
    for (const rosbag::ConnectionInfo* c : all.getConnections())
      if (c->datatype == "sensor_msgs/Image" || c->datatype == "sensor_msgs/CompressedImage")
        if (!contains(c->topic, "compressedDepth")) topics_[c->topic].type = c->datatype;
    for (auto& [name, t] : topics_) {
      t.name = name;
      rosbag::View view{bag_, rosbag::TopicQuery(name)};
      for (const rosbag::MessageInstance& m : view) t.messages.push_back(m);
      if (t.type == "sensor_msgs/CompressedImage") {
        t.encoding = "compressed";
      } else if (!t.messages.empty()) {
        if (const auto m = t.messages.front().instantiate<ros_messages::image>()) t.encoding = m->encoding;
      }
    }
    std::erase_if(topics_, [](const auto& t) { return t.second.messages.empty(); });
  }

  [[nodiscard]] std::string topics_in_words() const {
    std::string text;
    for (const auto& [name, t] : topics_) text += (text.empty() ? "" : ", ") + name + " (" + t.encoding + ")";
    return text.empty() ? "there are no images in it" : "there are " + text;
  }

  result<void> choose(const file_recording_options& options) {
    const auto wrong = [&](const std::string& what) {
      return fail(errc::invalid_argument, path_, what + "; " + topics_in_words());
    };
    if (topics_.empty()) return fail(errc::no_data, path_, "there are no images in this bag");
    if (!options.topics.empty()) {
      for (const std::string& name : options.topics)
        if (!topics_.contains(name)) return wrong("has no images in " + name);
      if (options.topics.size() > 2) return wrong("one or two topics are wanted");
      first_ = &topics_.at(options.topics[0]);
      if (options.topics.size() == 2) second_ = &topics_.at(options.topics[1]);
      sensor = second_ == nullptr    ? orbis::slam::sensor_kind::monocular
               : second_->is_depth() ? orbis::slam::sensor_kind::rgbd
                                     : orbis::slam::sensor_kind::stereo;
      if (options.sensor && *options.sensor != sensor) return wrong("these topics are not what the sensor gives");
      return {};
    }
    // Colour before grey, rectified before raw, and what is not compressed; depth that says it is registered.
    topic *color = nullptr, *depth = nullptr, *left = nullptr, *right = nullptr;
    int best_color = -1, best_depth = -1, best_left = -1;
    const auto worth = [](const topic& t) {
      return 4 * (t.encoding != "compressed") + 2 * (contains(t.encoding, "rgb") || contains(t.encoding, "bgr")) +
             contains(t.name, "rect");
    };
    for (auto& [name, t] : topics_) {
      if (t.is_depth()) {
        const int value = contains(name, "registered") || contains(name, "aligned") ? 1 : 0;
        if (value > best_depth) depth = &t, best_depth = value;
        continue;
      }
      if (t.encoding != "compressed" && bytes_of(t.encoding) == 0) continue;
      if (worth(t) > best_color) color = &t, best_color = worth(t);
      for (auto& [other_name, other] : topics_)
        if (is_pair(name, other_name) && !other.is_depth() && worth(t) > best_left)
          left = &t, right = &other, best_left = worth(t);
    }
    const auto possible = [&](orbis::slam::sensor_kind s) {
      return s == orbis::slam::sensor_kind::rgbd     ? color != nullptr && depth != nullptr
             : s == orbis::slam::sensor_kind::stereo ? left != nullptr
                                                     : color != nullptr;
    };
    std::optional<orbis::slam::sensor_kind> found = options.sensor;
    for (const orbis::slam::sensor_kind s :
         {orbis::slam::sensor_kind::rgbd, orbis::slam::sensor_kind::stereo, orbis::slam::sensor_kind::monocular})
      if (!found && possible(s)) found = s;
    if (!found || !possible(*found)) return wrong("has not the images that are wanted");
    sensor = *found;
    first_ = sensor == orbis::slam::sensor_kind::stereo ? left : color;
    second_ = sensor == orbis::slam::sensor_kind::rgbd     ? depth
              : sensor == orbis::slam::sensor_kind::stereo ? right
                                                           : nullptr;
    return {};
  }

  /// Of their headers; where these say nothing, when they were recorded.
  static void read_times(topic& t) {
    std::vector<std::pair<double, std::size_t>> order;
    for (const rosbag::MessageInstance& m : t.messages) {
      const auto header = m.instantiate<ros_messages::stamp>();
      const bool has_time = header && (header->sec != 0 || header->nsec != 0);
      order.emplace_back(has_time ? header->sec + 1e-9 * header->nsec : m.getTime().toSec(), order.size());
    }
    std::stable_sort(order.begin(), order.end());
    order.erase(
        std::unique(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first == b.first; }),
        order.end());
    std::vector<rosbag::MessageInstance> sorted;
    for (const auto& [time, i] : order) {
      t.times.push_back(time);
      sorted.push_back(t.messages[i]);
    }
    t.messages.swap(sorted);
  }

  void pair_frames() {
    if (second_ == nullptr) {
      for (std::uint32_t i = 0; i != first_->times.size(); ++i) frames_.push_back({i, i});
      return;
    }
    frames_ = orbis::associate(first_->times, second_->times, sensor == orbis::slam::sensor_kind::rgbd ? 0.020 : 0.005);
    if (const std::size_t lonely = first_->times.size() - frames_.size(); lonely != 0)
      notes.push_back(std::to_string(lonely) + " of " + std::to_string(first_->times.size()) + " images of " +
                      first_->name + " have no partner and are left out");
  }

  /// The first `CameraInfo` beside the images of `of`; null if there is none.
  boost::shared_ptr<ros_messages::camera_info> info_of(const topic& of) {
    std::string name = of.name;
    if (of.encoding == "compressed") name = name.substr(0, name.rfind('/'));
    name = name.substr(0, name.rfind('/') + 1) + "camera_info";
    rosbag::View view{bag_, rosbag::TopicQuery(name)};
    for (const rosbag::MessageInstance& m : view)
      if (auto info = m.instantiate<ros_messages::camera_info>()) return info;
    return {};
  }

  result<void> find_camera(const file_recording_options& options) {
    const bool in_metres = sensor == orbis::slam::sensor_kind::rgbd && second_->encoding == "32FC1";
    if (options.camera) {
      camera = *options.camera;
      if (in_metres) camera.depth_scale = metres_scale;
      if (sensor == orbis::slam::sensor_kind::stereo && !camera.baseline)
        return fail(errc::invalid_argument, path_, "a stereo camera wants a baseline");
      return {};
    }
    const auto info = info_of(*first_);
    if (!info)
      return fail(
          errc::invalid_argument, path_,
          "the camera is not known: there is no sensor_msgs/CameraInfo beside " + first_->name + "; name a camera");
    const auto rectified = [](const topic& t) { return contains(t.name, "rect"); };
    auto model = camera_of(*info, rectified(*first_), where(*first_));
    if (!model) return fail(model.error());
    camera = {.model = *std::move(model), .depth_scale = in_metres ? metres_scale : 1000.0, .fps = rate()};
    if (sensor != orbis::slam::sensor_kind::stereo) return {};

    const auto other = info_of(*second_);
    if (!other)
      return fail(errc::invalid_argument, path_, "there is no sensor_msgs/CameraInfo beside " + second_->name);
    const auto right = camera_of(*other, rectified(*second_), where(*second_));
    if (!right) return fail(right.error());
    // P of the right camera is that of the left one, moved along x; R turns a camera's rays to the rectified ones.
    const double baseline = other->P[0] > 0.0 ? (info->P[3] - other->P[3]) / other->P[0] : 0.0;
    if (!(baseline > 0.0))
      return fail(errc::malformed, where(*second_), "P of its CameraInfo does not say how far the cameras are apart");
    orbis::se3 T_left_right{orbis::so3{}, orbis::vec3{baseline, 0.0, 0.0}};
    if (!rectified(*first_)) {
      const auto rotation = [](const auto& R) -> std::optional<orbis::so3> {
        orbis::mat3 m;
        m << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
        if ((m.transpose() * m - orbis::mat3::Identity()).norm() > 1e-3 || m.determinant() < 0.0) return std::nullopt;
        return orbis::so3{orbis::so3::quaternion(m)};
      };
      const auto l = rotation(info->R), r = rotation(other->R);
      if (!l || !r) return fail(errc::malformed, path_, "R of a CameraInfo is no rotation");
      T_left_right = orbis::se3{l->inverse(), orbis::vec3::Zero()} * T_left_right * orbis::se3{*r, orbis::vec3::Zero()};
    }
    auto straight = orbis::camera::rectify(
        orbis::camera::stereo_rig<orbis::camera::any_camera>{camera.model, *right, T_left_right});
    if (!straight) return fail(straight.error().code, path_, straight.error().message);
    raw_left_ = camera.model;
    raw_right_ = *right;
    camera.model = straight->camera();
    camera.baseline = straight->baseline();
    if (!straight->is_identity()) straight_ = *std::move(straight);
    return {};
  }

  /// Images per second.
  [[nodiscard]] double rate() const {
    const auto& t = first_->times;
    const double span = t.back() - t.front();
    return span > 0.0 ? std::clamp(static_cast<double>(t.size() - 1) / span, 1.0, 1000.0) : 30.0;
  }

  template <class Image>
  [[nodiscard]] result<Image> sized(result<Image> image, const topic& of) const {
    if (!image) return image;
    const auto& k = straight_ ? (&of == first_ ? raw_left_.k() : raw_right_.k()) : camera.model.k();
    if (image->width() == k.width && image->height() == k.height) return image;
    const std::string why =
        sensor == orbis::slam::sensor_kind::rgbd && &of == second_ ? ": depth is not registered to colour" : "";
    return fail(errc::malformed, where(of),
                "the image has " + std::to_string(image->width()) + "x" + std::to_string(image->height()) +
                    " pixels, the camera " + std::to_string(k.width) + "x" + std::to_string(k.height) + why);
  }
  [[nodiscard]] result<color_image> read_color(const topic& of, std::size_t i) const try {
    if (of.encoding == "compressed") {
      const auto m = of.messages[i].instantiate<ros_messages::compressed_image>();
      if (!m) return fail(errc::malformed, where(of), "is no sensor_msgs/CompressedImage");
      const std::string_view bytes{reinterpret_cast<const char*>(m->data.data()), m->data.size()};
      return sized(orbis::io::is_png(bytes) ? orbis::io::decode_png_color(bytes, where(of))
                                            : orbis::io::decode_jpeg(bytes, where(of)),
                   of);
    }
    const auto m = of.messages[i].instantiate<ros_messages::image>();
    if (!m) return fail(errc::malformed, where(of), "is no sensor_msgs/Image");
    return sized(color_of(*m, where(of)), of);
  } catch (const std::exception& e) {  // of the library
    return fail(errc::malformed, where(of), e.what());
  }
  [[nodiscard]] result<depth_image> read_depth(std::size_t i) const try {
    const auto m = second_->messages[i].instantiate<ros_messages::image>();
    if (!m) return fail(errc::malformed, where(*second_), "is no sensor_msgs/Image");
    return sized(depth_of(*m, where(*second_)), *second_);
  } catch (const std::exception& e) {
    return fail(errc::malformed, where(*second_), e.what());
  }

  std::string path_;
  rosbag::Bag bag_;
  mutable std::mutex mutex_;  // of the bag, which reads into a buffer of its own
  std::map<std::string, topic> topics_;
  topic* first_ = nullptr;   // colour, or the left image
  topic* second_ = nullptr;  // depth, or the right image; null: one camera
  std::vector<orbis::index_pair> frames_;
  std::optional<orbis::camera::rectification> straight_;  // of stereo images that are not rectified yet
  orbis::camera::any_camera raw_left_, raw_right_;
};

}  // namespace

bool has_bags() { return true; }

result<std::unique_ptr<file_recording>> open_bag(const std::filesystem::path& path,
                                                 const file_recording_options& options) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return fail(errc::not_found, path.string(), "no such file");
  auto bag = std::make_unique<bag_recording>();
  if (auto opened = bag->open(path, options); !opened) return fail(opened.error());
  return bag;
}

}  // namespace app

#else

namespace app {

bool has_bags() { return false; }

orbis::result<std::unique_ptr<file_recording>> open_bag(const std::filesystem::path& path,
                                                        const file_recording_options&) {
  return orbis::fail(orbis::errc::unsupported, path.string(),
                     "this build reads no ROS bags: it was made without rosbag_storage (librosbag-storage-dev)");
}

}  // namespace app

#endif
