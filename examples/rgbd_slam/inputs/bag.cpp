// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/file_recording.hpp"

#ifdef RGBD_SLAM_BAG
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <orbis/camera/stereo.hpp>
#include <orbis/core/trajectory.hpp>

#include "inputs/ros_images.hpp"
#include "inputs/ros_messages.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;
using color_image = orbis::image<orbis::rgb8>;
using depth_image = orbis::image<std::uint16_t>;

/// The camera of `info`. `rectified`: the images are rectified.
result<orbis::camera::any_camera> camera_of(const ros_messages::camera_info& info, bool rectified,
                                            const std::string& where) {
  if (info.width == 0 || info.height == 0 || info.width > 65536 || info.height > 65536)
    return fail(errc::malformed, where, "has a camera without image size: is the camera calibrated?");
  const auto width = static_cast<int>(info.width), height = static_cast<int>(info.height);
  const orbis::camera::intrinsics k =
      rectified && info.P[0] > 0.0
          ? orbis::camera::intrinsics{width, height, info.P[0], info.P[5], info.P[2], info.P[6]}
          : orbis::camera::intrinsics{width, height, info.K[0], info.K[4], info.K[2], info.K[5]};
  if (!orbis::camera::is_valid(k))
    return fail(errc::malformed, where, "has no camera matrix: is the camera calibrated?");
  const auto& d = info.D;
  if (!std::all_of(d.begin(), d.end(), [](double v) { return std::isfinite(v); }))
    return fail(errc::malformed, where, "has a distortion that is not finite");
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
              "distortion model \"" + in_short(info.distortion_model) + "\" with " + std::to_string(d.size()) +
                  " numbers is not supported; use plumb_bob, rational_polynomial or equidistant");
}

/// The messages of a topic.
struct topic {
  std::string name, type, encoding;  ///< encoding: of the first image, or the format of a compressed image
  std::vector<double> times;         ///< of their headers, ascending
  std::vector<rosbag::MessageInstance> messages;
  [[nodiscard]] bool is_compressed() const { return type == "sensor_msgs/CompressedImage"; }
  [[nodiscard]] bool is_depth() const { return is_depth_encoding(encoding) || name.ends_with("/compressedDepth"); }
  [[nodiscard]] bool is_read() const { return is_compressed() || is_known_encoding(encoding); }
  /// Returns true if the name indicates rectified images: "image_rect" and "rect", but not "direct".
  [[nodiscard]] bool is_rectified() const {
    for (std::size_t at = name.find("rect"); at != std::string::npos; at = name.find("rect", at + 1))
      if (at == 0 || name[at - 1] == '/' || name[at - 1] == '_') return true;
    return false;
  }
};

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

/// Returns true if the topics are those of a left and a right camera.
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
    } catch (const std::exception& e) {  // of the library, for a damaged bag or another file
      return fail(errc::malformed, path_, std::string{"is not a readable ROS 1 bag: "} + e.what());
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
                      : "no image of " + first_->name + " has a counterpart in " + second_->name + " at its time");
    images_of = first_->name + (second_ != nullptr ? " and " + second_->name : "");
    if (auto known = find_camera(options); !known) return known;
    if (auto fits = frame(0); !fits) return fail(fits.error());
    return {};
  }

  void list_topics() {
    rosbag::View all{bag_};
    for (const rosbag::ConnectionInfo* c : all.getConnections())
      if (c->datatype == "sensor_msgs/Image" || c->datatype == "sensor_msgs/CompressedImage")
        topics_[c->topic].type = c->datatype;
    for (auto& [name, t] : topics_) {
      t.name = name;
      rosbag::View view{bag_, rosbag::TopicQuery(name)};
      for (const rosbag::MessageInstance& m : view) t.messages.push_back(m);
      if (t.messages.empty()) continue;
      if (t.is_compressed()) {
        if (const auto m = t.messages.front().instantiate<ros_messages::compressed_image>()) t.encoding = m->format;
      } else if (const auto m = t.messages.front().instantiate<ros_messages::image>()) {
        t.encoding = m->encoding;
      }
    }
    std::erase_if(topics_, [](const auto& t) { return t.second.messages.empty(); });
  }

  [[nodiscard]] std::string describe_topics() const {
    std::string text;
    for (const auto& [name, t] : topics_) text += (text.empty() ? "" : ", ") + name + " (" + in_short(t.encoding) + ")";
    return text.empty() ? "it contains no images" : "it contains " + text;
  }

  result<void> choose(const file_recording_options& options) {
    const auto wrong = [&](const std::string& what) {
      return fail(errc::invalid_argument, path_, what + "; " + describe_topics());
    };
    if (topics_.empty()) return fail(errc::no_data, path_, "the bag contains no images");
    if (!options.topics.empty()) {
      for (const std::string& name : options.topics)
        if (!topics_.contains(name)) return wrong("has no images in " + name);
      if (options.topics.size() > 2) return wrong("needs one or two topics");
      first_ = &topics_.at(options.topics[0]);
      if (options.topics.size() == 2) second_ = &topics_.at(options.topics[1]);
      sensor = second_ == nullptr    ? orbis::slam::sensor_kind::monocular
               : second_->is_depth() ? orbis::slam::sensor_kind::rgbd
                                     : orbis::slam::sensor_kind::stereo;
      if (options.sensor && *options.sensor != sensor) return wrong("the topics do not match --sensor");
      return {};
    }
    // Preference: uncompressed, then colour over grey, then rectified over raw; depth that is registered by its name.
    topic *color = nullptr, *depth = nullptr, *left = nullptr, *right = nullptr;
    int best_color = -1, best_depth = -1, best_left = -1;
    const auto worth = [](const topic& t) {
      const bool is_mosaic = t.encoding.starts_with("bayer");
      const bool is_color = !is_mosaic && (contains(t.encoding, "rgb") || contains(t.encoding, "bgr"));
      return 8 * !t.is_compressed() + 4 * is_color + 2 * is_mosaic + t.is_rectified();
    };
    for (auto& [name, t] : topics_) {
      if (t.is_depth()) {
        if (!t.is_read()) continue;
        const int value = 2 * (contains(name, "registered") || contains(name, "aligned")) + !t.is_compressed();
        if (value > best_depth) depth = &t, best_depth = value;
        continue;
      }
      if (!t.is_read()) continue;
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
    if (!found || !possible(*found)) {
      const bool any_unread =
          std::any_of(topics_.begin(), topics_.end(), [](const auto& t) { return !t.second.is_read(); });
      return wrong(any_unread ? "has no suitable images in a supported encoding" : "has no suitable images");
    }
    sensor = *found;
    first_ = sensor == orbis::slam::sensor_kind::stereo ? left : color;
    second_ = sensor == orbis::slam::sensor_kind::rgbd     ? depth
              : sensor == orbis::slam::sensor_kind::stereo ? right
                                                           : nullptr;
    return {};
  }

  /// Reads the times of the headers, or the recording times if the headers have none.
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
    if (const std::size_t unpaired = first_->times.size() - frames_.size(); unpaired != 0)
      notes.push_back(std::to_string(unpaired) + " of " + std::to_string(first_->times.size()) + " images of " +
                      first_->name + " have no counterpart and are omitted");
  }

  /// The first `CameraInfo` of the camera of `of`; null if there is none.
  boost::shared_ptr<ros_messages::camera_info> info_of(const topic& of) {
    std::string name = of.name;
    if (of.is_compressed()) name = name.substr(0, name.rfind('/'));
    name = name.substr(0, name.rfind('/') + 1) + "camera_info";
    rosbag::View view{bag_, rosbag::TopicQuery(name)};
    for (const rosbag::MessageInstance& m : view)
      if (auto info = m.instantiate<ros_messages::camera_info>()) return info;
    return {};
  }

  result<void> find_camera(const file_recording_options& options) {
    const bool in_metres = sensor == orbis::slam::sensor_kind::rgbd && is_in_metres(second_->encoding);
    if (options.camera) {
      camera = *options.camera;
      if (in_metres) camera.depth_scale = metres_scale;
      if (sensor == orbis::slam::sensor_kind::stereo && !camera.baseline)
        return fail(errc::invalid_argument, path_, "a stereo camera needs a baseline");
      return {};
    }
    const auto info = info_of(*first_);
    if (!info)
      return fail(errc::invalid_argument, path_,
                  "unknown camera: there is no sensor_msgs/CameraInfo for " + first_->name + "; specify a camera");
    auto model = camera_of(*info, first_->is_rectified(), where(*first_));
    if (!model) return fail(model.error());
    camera = {.model = *std::move(model), .depth_scale = in_metres ? metres_scale : 1000.0, .fps = rate()};
    if (sensor != orbis::slam::sensor_kind::stereo) return {};

    const auto other = info_of(*second_);
    if (!other) return fail(errc::invalid_argument, path_, "there is no sensor_msgs/CameraInfo for " + second_->name);
    const auto right = camera_of(*other, second_->is_rectified(), where(*second_));
    if (!right) return fail(right.error());
    // P of the right camera is that of the left one, shifted along x; R rotates the rays of a camera to rectified ones.
    const double baseline = other->P[0] > 0.0 ? (info->P[3] - other->P[3]) / other->P[0] : 0.0;
    if (!(baseline > 0.0)) return fail(errc::malformed, where(*second_), "P of its CameraInfo has no baseline");
    orbis::se3 T_left_right{orbis::so3{}, orbis::vec3{baseline, 0.0, 0.0}};
    if (!first_->is_rectified()) {
      const auto rotation = [](const auto& R) -> std::optional<orbis::so3> {
        orbis::mat3 m;
        m << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
        if (!((m.transpose() * m - orbis::mat3::Identity()).norm() < 1e-3) || m.determinant() < 0.0)
          return std::nullopt;
        return orbis::so3{orbis::so3::quaternion(m)};
      };
      const auto l = rotation(info->R), r = rotation(other->R);
      if (!l || !r) return fail(errc::malformed, path_, "R of a CameraInfo is not a rotation");
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
  /// `decode` of a message of either type.
  template <class Decode>
  [[nodiscard]] auto decoded(const topic& of, std::size_t i, const Decode& decode) const
      -> decltype(decode(ros_messages::image{}, std::string{})) {
    if (of.is_compressed()) {
      if (const auto m = of.messages[i].instantiate<ros_messages::compressed_image>()) return decode(*m, where(of));
    } else if (const auto m = of.messages[i].instantiate<ros_messages::image>()) {
      return decode(*m, where(of));
    }
    return fail(errc::malformed, where(of), "is not a " + of.type);
  }
  [[nodiscard]] result<color_image> read_color(const topic& of, std::size_t i) const try {
    return sized(decoded(of, i, [](const auto& m, const std::string& from) { return color_of(m, from); }), of);
  } catch (const std::exception& e) {  // of the library
    return fail(errc::malformed, where(of), e.what());
  }
  [[nodiscard]] result<depth_image> read_depth(std::size_t i) const try {
    return sized(decoded(*second_, i, [](const auto& m, const std::string& from) { return depth_of(m, from); }),
                 *second_);
  } catch (const std::exception& e) {
    return fail(errc::malformed, where(*second_), e.what());
  }

  std::string path_;
  rosbag::Bag bag_;
  mutable std::mutex mutex_;  // guards the bag, which reads into an internal buffer
  std::map<std::string, topic> topics_;
  topic* first_ = nullptr;   // colour, or the left image
  topic* second_ = nullptr;  // depth, or the right image; null: monocular
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
                     "this build has no support for ROS bags: it was built without rosbag_storage "
                     "(librosbag-storage-dev)");
}

}  // namespace app

#endif
