// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <sstream>
#include <string_view>
#include <tuple>
#include <utility>

#include <orbis/camera/stereo.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/trajectory.hpp>

#include "inputs/bag_file.hpp"
#include "inputs/depth_registration.hpp"
#include "inputs/file_recording.hpp"
#include "inputs/frame_tree.hpp"
#include "inputs/ros_images.hpp"
#include "inputs/ros_messages.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;
using orbis::slam::sensor_kind;
using color_image = orbis::image<orbis::rgb8>;
using depth_image = orbis::image<std::uint16_t>;

double seconds(std::int64_t nanoseconds) {
  constexpr std::int64_t second = 1'000'000'000;
  return static_cast<double>(nanoseconds / second) + 1e-9 * static_cast<double>(nanoseconds % second);
}

/// Sorts elements by their member `time` and removes those with repeated times. Returns the number of removed elements.
template <class T, class Time>
std::size_t sort_by_time(std::vector<T>& all, Time T::*time) {
  std::ranges::stable_sort(all, {}, time);
  const std::size_t before = all.size();
  all.erase(std::unique(all.begin(), all.end(), [&](const T& a, const T& b) { return a.*time == b.*time; }), all.end());
  return before - all.size();
}

std::string in_words(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

/// The beginning of a sentence: "1 image of /camera is", "2 images of /camera are".
std::string count_text(std::size_t n, const std::string& what, const std::string& from) {
  return std::to_string(n) + " " + what + (n == 1 ? " of " : "s of ") + from + (n == 1 ? " is" : " are");
}

bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// An image topic.
struct topic : bag_topic {
  std::string encoding;       ///< encoding of the first image, or format of a compressed image
  std::string frame_id;       ///< coordinate frame of the first image
  std::vector<double> times;  ///< times in the headers, ascending
  std::size_t unread = 0;     ///< number of omitted messages
  std::string reason;         ///< the reason for the first omission
  [[nodiscard]] bool is_compressed() const { return type == "sensor_msgs/CompressedImage"; }
  [[nodiscard]] bool is_depth() const { return is_depth_encoding(encoding) || name.ends_with("/compressedDepth"); }
  [[nodiscard]] bool is_read() const { return is_compressed() || is_known_encoding(encoding); }
  /// Returns true if the name indicates depth that is registered to colour, not to an infrared camera.
  [[nodiscard]] bool is_registered() const {
    return (contains(name, "registered") || contains(name, "aligned")) && !contains(name, "to_infra");
  }
  /// Returns true if the name indicates infrared or thermal images, or depth confidence. Ignores components that
  /// contain "depth": "image_ir" indicates infrared, but "aligned_depth_to_infra1" does not.
  [[nodiscard]] bool is_auxiliary() const {
    for (std::string_view rest = name; !rest.empty();) {
      std::string_view component = rest.substr(0, rest.find('/'));
      rest.remove_prefix(std::min(component.size() + 1, rest.size()));
      if (contains(component, "depth")) continue;
      while (!component.empty()) {
        const std::string_view word = component.substr(0, component.find('_'));
        component.remove_prefix(std::min(word.size() + 1, component.size()));
        if (word == "ir" || word.starts_with("Infra") || word == "thermal" || word.starts_with("infra") ||
            word.starts_with("confidence"))
          return true;
      }
    }
    return false;
  }
  /// Returns true if the frame of the images is known. All images in librealsense bags have the frame "0".
  [[nodiscard]] bool has_frame() const {
    return !frame_id.empty() && frame_id != "0" && !name.ends_with("/image/data");
  }
  /// Returns true if the name indicates rectified images: "image_rect" and "rect", but not "direct".
  [[nodiscard]] bool is_rectified() const {
    for (std::size_t at = name.find("rect"); at != std::string::npos; at = name.find("rect", at + 1))
      if (at == 0 || name[at - 1] == '/' || name[at - 1] == '_') return true;
    return false;
  }
};

bool is_transform_type(const std::string& type) { return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage"; }
bool is_static(std::string_view name) { return name.ends_with("tf_static"); }
bool is_pose_type(const std::string& type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped";
}

/// Returns true if the images are known to be in the same coordinate frame.
bool has_same_frame(const topic& a, const topic& b) {
  return a.has_frame() && b.has_frame() && a.frame_id == b.frame_id;
}

/// The number of leading components that two names have in common.
std::ptrdiff_t common_components(const std::string& a, const std::string& b) {
  return std::count(a.begin(), std::ranges::mismatch(a, b).in1, '/');
}

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
  bag_recording(bag contents, std::string path) : path_{std::move(path)}, bag_{std::move(contents)} {
    kind = "ROS bag";
    files = bag_.files;
    notes = bag_.notes;
  }

  result<void> set_up(const file_recording_options& options) {
    for (const bag_topic& t : bag_.topics)
      if (t.type == "sensor_msgs/CameraInfo") info_topics_.try_emplace(t.name, &t);
    if (auto listed = list_topics(); !listed) return listed;
    if (auto chosen = choose(options); !chosen) return chosen;
    if (auto read = read_times(); !read) return read;
    pair_frames();
    if (frames_.empty())
      return fail(errc::no_data, path_,
                  second_ == nullptr
                      ? "no image in " + first_->name
                      : "no image of " + first_->name + " has a counterpart in " + second_->name + " at the same time");
    images_of = first_->name + (second_ != nullptr ? " and " + second_->name : "");
    if (auto known = find_camera(options); !known) return known;
    if (sensor == sensor_kind::rgbd)
      if (auto registered = register_depth(); !registered) return registered;
    if (!options.truth_topic.empty())
      if (auto known = read_truth(options.truth_topic); !known) return known;
    if (auto fits = frame(0); !fits) return fail(fits.error());
    return {};
  }

  [[nodiscard]] std::size_t size() const override { return frames_.size(); }
  [[nodiscard]] result<source_frame> frame(std::size_t i) const override {
    auto first = color(i);
    if (!first) return fail(first.error());
    source_frame f;
    f.timestamp = first_->times[frames_[i].first];
    f.depth_scale = camera.depth_scale;
    f.color = *std::move(first);
    if (sensor == sensor_kind::rgbd) {
      auto depth = read_depth(frames_[i].second);
      if (!depth) return fail(depth.error());
      f.depth_timestamp = second_->times[frames_[i].second];
      f.depth = registration_ ? (*registration_)(depth->view(), camera.depth_scale) : *std::move(depth);
    } else if (sensor == sensor_kind::stereo) {
      auto second = read_color(*second_, frames_[i].second);
      if (!second) return fail(second.error());
      f.right = straight_ ? straight_->right().bilinear(second->view()) : *std::move(second);
    }
    return f;
  }
  [[nodiscard]] result<color_image> color(std::size_t i) const override {
    auto first = read_color(*first_, frames_[i].first);
    if (first && straight_) return straight_->left().bilinear(first->view());
    return first;
  }

 private:
  [[nodiscard]] std::string where(const topic& of) const { return path_ + " " + of.name; }
  [[nodiscard]] result<std::string> read(const bag_message& m, std::size_t most = whole_message) const {
    const std::lock_guard lock{mutex_};
    return bag_.read(m, most);
  }

  /// Messages in ascending order of this key are in the order in which they are stored.
  [[nodiscard]] static auto place_of(const bag_message& m) { return std::tuple{m.file, m.chunk, m.at}; }
  /// The messages in the order in which they are stored, in which each chunk is decompressed only once.
  [[nodiscard]] static std::vector<bag_message> in_file_order(std::vector<bag_message> messages) {
    std::ranges::sort(messages, {}, place_of);
    return messages;
  }

  /// Lists the image topics. Encoding and frame are those of the first readable message.
  result<void> list_topics() {
    for (bag_topic& from : bag_.topics) {
      if (from.type != "sensor_msgs/Image" && from.type != "sensor_msgs/CompressedImage") continue;
      topic t{std::move(from), {}, {}, {}, 0, {}};
      const auto take = [&](const auto& image, const std::string& encoding) {
        if (!image) return false;
        t.encoding = encoding;
        t.frame_id = image->header.frame_id;
        return true;
      };
      bool is_found = false;
      for (const bag_message& m : in_file_order(t.messages)) {
        const auto bytes = read(m);
        if (!bytes && bytes.error().code == errc::unsupported) return fail(bytes.error());
        if (!bytes) continue;
        if (t.is_compressed()) {
          const auto image = ros_messages::parse<ros_messages::compressed_image>(*bytes, t.coding, t.name);
          is_found = take(image, image ? image->format : "");
        } else {
          const auto image = ros_messages::parse<ros_messages::image>(*bytes, t.coding, t.name);
          is_found = take(image, image ? image->encoding : "");
        }
        if (is_found) break;
      }
      if (is_found)
        topics_.try_emplace(t.name, std::move(t));
      else
        notes.push_back("no image of " + t.name + " can be read");
    }
    return {};
  }

  [[nodiscard]] std::string describe_topics() const {
    std::string text;
    for (const auto& [name, t] : topics_)
      text += (text.empty() ? "" : ", ") + name + " (" + orbis::shortened(t.encoding, 60) + ")";
    return text.empty() ? "it contains no images" : "it contains " + text;
  }

  result<void> choose(const file_recording_options& options) {
    const auto wrong = [&](const std::string& what) {
      return fail(errc::invalid_argument, path_, what + "; " + describe_topics());
    };
    if (topics_.empty())
      return fail(errc::no_data, path_, "the bag contains no images" + (notes.empty() ? "" : "; " + notes.back()));
    if (!options.topics.empty()) {
      for (const std::string& name : options.topics)
        if (!topics_.contains(name)) return wrong("has no images in " + name);
      if (options.topics.size() > 2) return wrong("needs one or two topics");
      first_ = &topics_.at(options.topics[0]);
      if (options.topics.size() == 2) second_ = &topics_.at(options.topics[1]);
      if (second_ != nullptr && first_->is_depth())
        return wrong("has depth images in " + first_->name + ": specify the colour topic first, then the depth topic");
      sensor = second_ == nullptr    ? sensor_kind::monocular
               : second_->is_depth() ? sensor_kind::rgbd
                                     : sensor_kind::stereo;
      if (options.sensor && *options.sensor != sensor) return wrong("the topics do not match --sensor");
      return {};
    }
    constexpr std::size_t most = 500;
    if (topics_.size() > most)
      return fail(errc::invalid_argument, path_,
                  "contains images in more than " + std::to_string(most) + " topics: specify one or two of them");
    const bool needs_info = !options.camera;
    const auto has_info = [&](const topic& t) { return needs_info && info_topic(t) != nullptr; };
    // Preference: with camera information, visible light, uncompressed, then colour over grey, then rectified over raw.
    const auto worth = [&](const topic& t) {
      const bool is_mosaic = t.encoding.starts_with("bayer");
      bool is_color = false;
      for (const char* part : {"rgb", "bgr", "yuv", "uyvy", "yuyv"}) is_color |= contains(t.encoding, part);
      is_color &= !is_mosaic;
      return std::tuple{has_info(t), !t.is_auxiliary(), !t.is_compressed(), is_color, is_mosaic, t.is_rectified()};
    };
    // Preference among pairs of colour and depth: the same frame, then the most name components in common.
    const auto pair_worth = [&](const topic& c, const topic& d) {
      return std::tuple{has_info(c),
                        !c.is_auxiliary(),
                        contains(d.name, "depth"),
                        has_same_frame(c, d),
                        common_components(c.name, d.name),
                        worth(c),
                        has_info(d),
                        d.is_registered(),
                        !d.is_compressed(),
                        d.is_rectified()};
    };
    topic *lone = nullptr, *color = nullptr, *depth = nullptr, *left = nullptr, *right = nullptr;
    for (auto& [name, t] : topics_) {
      if (t.is_depth() || !t.is_read()) continue;
      if (lone == nullptr || worth(t) > worth(*lone)) lone = &t;
      for (auto& [other_name, other] : topics_) {
        if (!other.is_read()) continue;
        if (other.is_depth() && !other.is_auxiliary()) {
          if (depth == nullptr || pair_worth(t, other) > pair_worth(*color, *depth)) color = &t, depth = &other;
        } else if (!other.is_depth() && is_pair(name, other_name)) {
          if (left == nullptr || std::pair{worth(t), worth(other)} > std::pair{worth(*left), worth(*right)})
            left = &t, right = &other;
        }
      }
    }
    const auto possible = [&](sensor_kind s) {
      return (s == sensor_kind::rgbd ? depth : s == sensor_kind::stereo ? left : lone) != nullptr;
    };
    std::optional<sensor_kind> found = options.sensor;
    for (const sensor_kind s : {sensor_kind::rgbd, sensor_kind::stereo, sensor_kind::monocular})
      if (!found && possible(s)) found = s;
    if (!found || !possible(*found)) {
      const bool any_unread =
          std::any_of(topics_.begin(), topics_.end(), [](const auto& t) { return !t.second.is_read(); });
      return wrong(any_unread ? "has no suitable images in a supported encoding" : "has no suitable images");
    }
    sensor = *found;
    first_ = sensor == sensor_kind::rgbd ? color : sensor == sensor_kind::stereo ? left : lone;
    second_ = sensor == sensor_kind::rgbd ? depth : sensor == sensor_kind::stereo ? right : nullptr;
    return {};
  }

  /// Reads the times of the headers, in the order of the file, or the recording times if the headers have none. Omits
  /// unreadable messages and messages with a repeated time.
  result<void> read_times() {
    struct entry {
      topic* of;
      const bag_message* message;
      std::int64_t time;
    };
    std::vector<entry> entries;
    for (topic* t : {first_, second_})
      if (t != nullptr)
        for (const bag_message& m : t->messages) entries.push_back({t, &m, 0});
    std::ranges::sort(entries, {}, [](const entry& e) { return place_of(*e.message); });
    for (entry& e : entries) {
      constexpr std::size_t most = 1024;  // bytes; the time is at the beginning
      const auto bytes = read(*e.message, most);
      if (!bytes && bytes.error().code == errc::unsupported) return fail(bytes.error());
      message_reader in{bytes ? *bytes : std::string_view{}, e.of->coding};
      e.time = ros_messages::read_stamp(in);
      if (bytes && in.ok()) continue;
      if (e.of->unread++ == 0) e.of->reason = bytes ? "a message is damaged" : bytes.error().to_string();
      e.message = nullptr;
    }
    std::erase_if(entries, [](const entry& e) { return e.message == nullptr; });
    for (topic* t : {first_, second_}) {
      if (t == nullptr) continue;
      if (t->unread != 0)
        notes.push_back(count_text(t->unread, "image", t->name) +
                        " omitted because of damage or truncation: " + t->reason);
      // A time of zero is the start of a simulation, or the header has no time.
      std::int64_t least = std::numeric_limits<std::int64_t>::max();
      for (const entry& e : entries)
        if (e.of == t && e.time != 0) least = std::min(least, e.time);
      constexpr std::int64_t soon = 10'000'000'000;  // nanoseconds
      std::vector<std::pair<std::int64_t, bag_message>> order;
      // Times that jump back belong to a second run: a simulation that was reset, or a recording that was played again.
      constexpr std::int64_t far = 1'000'000'000;  // nanoseconds
      std::int64_t last = std::numeric_limits<std::int64_t>::min();
      std::size_t later = 0;
      for (const entry& e : entries) {
        if (e.of != t) continue;
        const bool has_time = e.time != 0 || least <= soon;
        if (later != 0 || (has_time && e.time + far < last)) {
          ++later;
          continue;
        }
        if (has_time) last = e.time;
        order.emplace_back(has_time ? e.time : e.message->time, *e.message);
      }
      if (later != 0)
        notes.push_back(count_text(later, "image", t->name) +
                        " omitted because the times in the headers jump back by more than 1 s after the first " +
                        std::to_string(order.size()));
      if (const std::size_t repeated = sort_by_time(order, &std::pair<std::int64_t, bag_message>::first); repeated != 0)
        notes.push_back(count_text(repeated, "image", t->name) + " omitted because another image has the same time");
      t->messages.clear();
      for (const auto& [when, message] : order) {
        t->times.push_back(seconds(when));
        t->messages.push_back(message);
      }
    }
    return {};
  }

  void pair_frames() {
    if (second_ == nullptr) {
      for (std::uint32_t i = 0; i != first_->times.size(); ++i) frames_.push_back({i, i});
      return;
    }
    frames_ = orbis::associate(first_->times, second_->times, sensor == sensor_kind::rgbd ? 0.020 : 0.005);
    if (const std::size_t unpaired = first_->times.size() - frames_.size(); unpaired != 0)
      notes.push_back(count_text(unpaired, "image", first_->name) + " omitted because no image of " + second_->name +
                      " has the same time");
  }

  /// The `CameraInfo` topic for the images in `of`; null if there is none. It is `camera_info` next to the images, or
  /// one level higher for compressed images, or, in librealsense bags, `info/camera_info` next to `image/data`.
  [[nodiscard]] const bag_topic* info_topic(const topic& of) const {
    const auto above = [](const std::string& name) { return name.substr(0, name.rfind('/')); };
    const std::string next = above(of.name), higher = above(next);
    for (const std::string& name : {next + "/camera_info", of.is_compressed() ? higher + "/camera_info" : "",
                                    (of.is_compressed() ? above(higher) : higher) + "/info/camera_info"})
      if (const auto at = info_topics_.find(name); at != info_topics_.end()) return at->second;
    return nullptr;
  }
  /// The first readable `CameraInfo` for the images in `of`; empty if there is none.
  [[nodiscard]] std::optional<ros_messages::camera_info> read_camera_info(const topic& of) const {
    if (const bag_topic* t = info_topic(of))
      for (const bag_message& m : in_file_order(t->messages))
        if (const auto bytes = read(m))
          if (auto info = ros_messages::parse<ros_messages::camera_info>(*bytes, t->coding, t->name))
            return *std::move(info);
    return std::nullopt;
  }

  /// Depth units per metre in a librealsense bag, from the option of the depth sensor; empty if there is none.
  [[nodiscard]] std::optional<double> stored_scale() const {
    for (const bag_topic& t : bag_.topics)
      if (is_depth_unit(t.name, t.type) && second_->name.starts_with(t.name.substr(0, t.name.find("option/"))))
        for (const bag_message& m : in_file_order(t.messages))
          if (const auto bytes = read(m)) {
            message_reader in{*bytes, t.coding};
            const auto metres = static_cast<double>(in.number<float>());
            if (in.ok() && metres > 1e-6 && metres < 1.0) return std::round(1e3 / metres) / 1e3;  // a decimal number
          }
    return std::nullopt;
  }

  result<void> find_camera(const file_recording_options& options) {
    const bool in_metres = sensor == sensor_kind::rgbd && is_in_metres(second_->encoding);
    if (options.camera) {
      camera = *options.camera;
      if (in_metres) camera.depth_scale = metres_scale;
      if (sensor == sensor_kind::stereo && !camera.baseline)
        return fail(errc::invalid_argument, path_, "a stereo camera needs a baseline");
      if (sensor == sensor_kind::stereo && !(first_->is_rectified() && second_->is_rectified()))
        notes.push_back("the images of " + images_of +
                        " are used as if they were rectified, because the camera is specified");
      if (sensor == sensor_kind::rgbd && !in_metres)
        if (const auto scale = stored_scale(); scale && std::abs(*scale / camera.depth_scale - 1.0) > 1e-3)
          notes.push_back("the bag stores " + in_words(*scale) + " depth units per metre; the specified camera has " +
                          in_words(camera.depth_scale));
      return {};
    }
    const auto info = read_camera_info(*first_);
    if (!info)
      return fail(errc::invalid_argument, path_,
                  "unknown camera: there is no sensor_msgs/CameraInfo for " + first_->name + "; specify a camera");
    auto model = ros_messages::make_camera(*info, first_->is_rectified(), where(*first_));
    if (!model) return fail(model.error());
    camera = {.model = *std::move(model), .depth_scale = in_metres ? metres_scale : 1000.0, .fps = rate()};
    if (sensor == sensor_kind::rgbd && !in_metres && second_->name.ends_with("/image/data")) {
      if (const auto scale = stored_scale())
        camera.depth_scale = *scale;
      else
        notes.push_back("the bag does not specify the depth unit of " + second_->name + "; millimetres are assumed");
    }
    if (sensor != sensor_kind::stereo) return {};

    const auto other = read_camera_info(*second_);
    if (!other) return fail(errc::invalid_argument, path_, "there is no sensor_msgs/CameraInfo for " + second_->name);
    const auto right = ros_messages::make_camera(*other, second_->is_rectified(), where(*second_));
    if (!right) return fail(right.error());
    // P of the right camera is that of the left camera, shifted along x; R rotates a camera's rays to rectified rays.
    const double baseline = other->P[0] > 0.0 ? (info->P[3] - other->P[3]) / other->P[0] : 0.0;
    orbis::se3 T_left_right{orbis::so3{}, orbis::vec3{baseline, 0.0, 0.0}};
    if (!(baseline > 0.0)) {
      const auto by_frames = static_transform(first_->frame_id, second_->frame_id);
      if (!by_frames || first_->frame_id == second_->frame_id)
        return fail(errc::malformed, where(*second_),
                    "P in its CameraInfo has no baseline, and no static transform "
                    "connects its frame to that of " +
                        first_->name);
      T_left_right = *by_frames;
    } else if (!first_->is_rectified()) {
      const auto rotation = [](const auto& R) -> std::optional<orbis::so3> {
        orbis::mat3 m;
        m << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
        if (!((m.transpose() * m - orbis::mat3::Identity()).norm() < 1e-3) || m.determinant() < 0.0)
          return std::nullopt;
        return orbis::so3{orbis::so3::quaternion(m)};
      };
      const auto l = rotation(info->R), r = rotation(other->R);
      if (!l || !r) return fail(errc::malformed, path_, "R in a CameraInfo is not a rotation");
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

  /// Calls `f` with each transform in the topics whose names satisfy `is_wanted`.
  template <class Wanted, class F>
  void for_each_transform(const Wanted& is_wanted, const F& f) const {
    for (const bag_topic& t : bag_.topics)
      if (is_transform_type(t.type) && is_wanted(t.name))
        for (const bag_message& m : in_file_order(t.messages))
          if (const auto bytes = read(m))
            if (const auto transforms =
                    ros_messages::parse<std::vector<ros_messages::transform>>(*bytes, t.coding, t.name))
              for (ros_messages::transform one : *transforms) {
                if (one.header.stamp == 0) one.header.stamp = m.time;
                f(one);
              }
  }
  /// The frames in /tf_static, which is read only once.
  [[nodiscard]] const frame_tree& static_frames() {
    if (!static_frames_) {
      static_frames_.emplace();
      for_each_transform(is_static, [&](const ros_messages::transform& t) { static_frames_->set(t); });
    }
    return *static_frames_;
  }
  /// The frames in /tf_static and in the other topics whose names satisfy `is_wanted`.
  template <class Wanted>
  [[nodiscard]] frame_tree frames_with(const Wanted& is_wanted) {
    frame_tree tree = static_frames();
    for_each_transform([&](const std::string& name) { return !is_static(name) && is_wanted(name); },
                       [&](const ros_messages::transform& t) { tree.add(t); });
    return tree;
  }
  /// `T_a_b` for frames that do not move relative to each other, even if it is published on /tf, as in ROS 1; empty if
  /// unknown.
  [[nodiscard]] std::optional<orbis::se3> static_transform(const std::string& a, const std::string& b) {
    if (const auto found = static_frames().transform(a, b)) return found;
    if (!all_frames_) all_frames_ = frames_with([](const std::string&) { return true; });
    return all_frames_->transform(a, b);
  }

  /// Prepares the registration of depth to colour by means of both cameras and the transform between them, unless both
  /// are known to have the same frame and size.
  result<void> register_depth() {
    const bool same_frame = has_same_frame(*first_, *second_);
    const auto info = read_camera_info(*second_);
    const bool same_size = !info || (static_cast<int>(info->width) == camera.model.width() &&
                                     static_cast<int>(info->height) == camera.model.height());
    if (same_frame && same_size) return {};
    const bool is_known = first_->has_frame() && second_->has_frame();
    const auto T_color_depth = same_frame ? std::optional{orbis::se3{}}
                               : is_known ? static_transform(first_->frame_id, second_->frame_id)
                                          : std::nullopt;
    if (!T_color_depth || !info) {
      unregistered_ = " (depth in the frame \"" + orbis::shortened(second_->frame_id, 60) + "\", colour in \"" +
                      orbis::shortened(first_->frame_id, 60) + "\"; " +
                      (!is_known ? "these names do not identify frames"
                       : info    ? "no static transform connects them"
                                 : "no CameraInfo for " + second_->name) +
                      ")";
      notes.push_back("depth is used as if it were registered to colour, but may not be" + unregistered_);
      return {};
    }
    const auto model = ros_messages::make_camera(*info, second_->is_rectified(), where(*second_));
    if (!model) return fail(model.error());
    registration_.emplace(*model, camera.model, *T_color_depth);
    images_of += same_frame ? " (registered by the cameras)" : " (registered by tf)";
    return {};
  }

  /// Reads the poses in a topic as the ground truth of the camera.
  result<void> read_truth(const std::string& name) {
    std::string others;
    const bag_topic* from = nullptr;
    for (const bag_topic& t : bag_.topics) {
      if (!is_transform_type(t.type) && !is_pose_type(t.type)) continue;
      if (t.name == name) from = &t;
      if (!is_transform_type(t.type) || !is_static(t.name))
        others += (others.empty() ? "; there are poses in " : ", ") + t.name;
    }
    if (from == nullptr) return fail(errc::invalid_argument, path_, "has no poses in " + name + others);
    if (is_transform_type(from->type) && is_static(name))
      return fail(errc::invalid_argument, path_, name + " has static transforms only" + others);
    const auto known = is_transform_type(from->type) ? read_truth_of_frames(name) : read_truth_of_body(*from);
    if (!known) return known;
    if (straight_)
      for (orbis::stamped_pose& p : ground_truth)
        p.T_world_camera = p.T_world_camera * orbis::se3{straight_->R_left_rectified(), orbis::vec3::Zero()};
    if (ground_truth.empty()) return fail(errc::no_data, path_, "no pose of " + name + " can be used");
    return {};
  }

  result<void> read_truth_of_body(const bag_topic& from) {
    const bool has_child = from.type == "nav_msgs/Odometry";
    ros_messages::transform pose;
    std::size_t unread = 0;
    for (const bag_message& m : in_file_order(from.messages)) {
      const auto bytes = read(m);
      if (!bytes && bytes.error().code == errc::unsupported) return fail(bytes.error());
      message_reader in{bytes ? *bytes : std::string_view{}, from.coding};
      ros_messages::transform one;
      read_pose(in, one, has_child);
      if (!bytes || !in.ok()) {
        ++unread;
        continue;
      }
      pose = std::move(one);
      ground_truth.push_back({seconds(pose.header.stamp != 0 ? pose.header.stamp : m.time), pose.T_parent_child});
    }
    if (unread != 0) notes.push_back(count_text(unread, "pose", from.name) + " damaged and omitted");
    sort_by_time(ground_truth, &orbis::stamped_pose::timestamp);
    const std::string camera_frame = first_->frame_id;
    truth_of = from.name + " (" + (has_child ? pose.child_frame_id : "body") + " in " + pose.header.frame_id + ")";
    const auto T_body_camera = has_child ? static_transform(pose.child_frame_id, camera_frame) : std::nullopt;
    for (orbis::stamped_pose& p : ground_truth)
      if (T_body_camera) p.T_world_camera = p.T_world_camera * *T_body_camera;
    if (!has_child)
      notes.push_back("poses of " + from.name + " are used as those of the camera; " + from.type +
                      " does not specify a body");
    else if (!T_body_camera)
      notes.push_back("poses of " + from.name + " are those of " + pose.child_frame_id +
                      ", not of the camera: no static transform connects that frame to " + camera_frame);
    return {};
  }

  /// Reads the poses of the camera's frame in the root frame at the times of the images.
  result<void> read_truth_of_frames(const std::string& name) {
    constexpr double most_gap = 0.5, most_distance = 0.05;  // seconds, between transforms and to the nearest one
    const auto is_named = [&](const std::string& topic) { return topic == name; };
    const frame_tree tree = frames_with(is_named);
    const std::vector<std::string> path = tree.path_to_root(first_->frame_id);
    std::map<std::string, orbis::trajectory> moving;  // name of the child -> poses
    for (const std::string& frame : path)
      if (const auto* link = tree.find(frame); link != nullptr && !link->is_constant) moving[frame];
    if (moving.empty())
      return fail(errc::no_data, path_,
                  "no transform of " + name + " moves the camera's frame \"" + path.front() + "\", whose root is \"" +
                      path.back() + "\"");
    for_each_transform(is_named, [&](const ros_messages::transform& t) {
      const auto at = moving.find(t.child_frame_id);
      if (at != moving.end() && t.header.frame_id == tree.find(t.child_frame_id)->parent)
        at->second.push_back({seconds(t.header.stamp), t.T_parent_child});
    });
    for (auto& [frame, poses] : moving) sort_by_time(poses, &orbis::stamped_pose::timestamp);
    for (const orbis::index_pair& f : frames_) {
      const double time = first_->times[f.first];
      std::optional<orbis::se3> T_up_camera{orbis::se3{}};
      for (std::size_t i = 0; i + 1 < path.size() && T_up_camera; ++i) {
        const auto at = moving.find(path[i]);
        const auto T_up = at == moving.end() ? std::optional{tree.find(path[i])->T_parent_child}
                                             : orbis::interpolate(at->second, time, most_gap, most_distance);
        T_up_camera = T_up ? std::optional{*T_up * *T_up_camera} : std::nullopt;
      }
      if (T_up_camera) ground_truth.push_back({time, *T_up_camera});
    }
    truth_of = name + " (" + path.front() + " in " + path.back() + ")";
    if (ground_truth.size() != frames_.size())
      notes.push_back(std::to_string(frames_.size() - ground_truth.size()) + " of " + std::to_string(frames_.size()) +
                      " images have no pose in " + name);
    return {};
  }

  /// Images per second.
  [[nodiscard]] double rate() const {
    const auto& t = first_->times;
    const double span = t.back() - t.front();
    return span > 0.0 ? std::clamp(static_cast<double>(t.size() - 1) / span, 1.0, 1000.0) : 30.0;
  }

  template <class Image>
  [[nodiscard]] result<Image> sized(result<Image> image, int width, int height, const topic& of) const {
    if (!image || (image->width() == width && image->height() == height)) return image;
    const bool is_depth = sensor == sensor_kind::rgbd && &of == second_;
    return fail(errc::malformed, where(of),
                "the image has " + std::to_string(image->width()) + "x" + std::to_string(image->height()) +
                    " pixels, but the camera has " + std::to_string(width) + "x" + std::to_string(height) +
                    (is_depth ? ": depth is not registered to colour" + unregistered_ : ""));
  }
  /// Applies `decode` to a message of type `Image` or `CompressedImage`.
  template <class Decode>
  [[nodiscard]] auto decoded(const topic& of, std::size_t i, const Decode& decode) const
      -> decltype(decode(ros_messages::image{}, std::string{})) {
    const auto bytes = read(of.messages[i]);
    if (!bytes) return fail(bytes.error());
    if (of.is_compressed()) {
      const auto m = ros_messages::parse<ros_messages::compressed_image>(*bytes, of.coding, where(of));
      if (!m) return fail(m.error());
      return decode(*m, where(of));
    }
    const auto m = ros_messages::parse<ros_messages::image>(*bytes, of.coding, where(of));
    if (!m) return fail(m.error());
    return decode(*m, where(of));
  }
  [[nodiscard]] result<color_image> read_color(const topic& of, std::size_t i) const {
    const auto& k = straight_ ? (&of == first_ ? raw_left_.k() : raw_right_.k()) : camera.model.k();
    return sized(decoded(of, i, [](const auto& m, const std::string& from) { return decode_color(m, from); }), k.width,
                 k.height, of);
  }
  [[nodiscard]] result<depth_image> read_depth(std::size_t i) const {
    auto depth = decoded(*second_, i, [](const auto& m, const std::string& from) { return decode_depth(m, from); });
    if (registration_) return sized(std::move(depth), registration_->width(), registration_->height(), *second_);
    return sized(std::move(depth), camera.model.width(), camera.model.height(), *second_);
  }

  std::string path_;
  mutable std::mutex mutex_;  // guards the bag
  mutable bag bag_;
  std::map<std::string, const bag_topic*> info_topics_;  // of type CameraInfo, by name
  std::map<std::string, topic> topics_;
  topic* first_ = nullptr;   // colour, or the left image
  topic* second_ = nullptr;  // depth, or the right image; null: monocular
  std::vector<orbis::index_pair> frames_;
  std::optional<orbis::camera::rectification> straight_;  // for stereo images that are not rectified yet
  orbis::camera::any_camera raw_left_, raw_right_;
  std::optional<depth_registration> registration_;        // for depth that is not registered yet
  std::optional<frame_tree> static_frames_, all_frames_;  // empty: not read yet
  std::string unregistered_;                              // the reason why depth cannot be registered
};

}  // namespace

result<std::unique_ptr<file_recording>> open_bag(const std::filesystem::path& path,
                                                 const file_recording_options& options) {
  auto contents = bag::open(path);
  if (!contents) return fail(contents.error());
  auto recording = std::make_unique<bag_recording>(*std::move(contents), path.string());
  if (auto ready = recording->set_up(options); !ready) return fail(ready.error());
  return recording;
}

}  // namespace app
