// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sequences of frames made of other ones: thinned, cut, blacked out, badly exposed.
///
/// Each function takes a sequence by value (copies are cheap) and gives another one, made frame by frame when asked
/// for; they can be put one on the other, and on recordings as well as on synthetic sequences.
///
/// @code
///   const auto hard = with_exposure(blacked_out(at_rate(loop, 15.0), {20.0, 22.0}), {.lowest = 0.5, .highest = 1.8});
/// @endcode
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>

#include "support/synthetic/sequence.hpp"

namespace orbis::test {

/// From `begin` to before `end`, seconds, as the frames' own time stamps count.
struct time_span {
  double begin = 0.0, end = 0.0;
  [[nodiscard]] constexpr bool contains(double time) const noexcept { return begin <= time && time < end; }
};

/// Some of a sequence's frames, perhaps at other times.
template <frame_sequence S>
class selection {
 public:
  struct pick {
    std::size_t index;  ///< in the sequence chosen from
    double timestamp;   ///< seconds
  };

  /// @pre all indices are below base.size()
  selection(S base, std::vector<pick> picks, double fps)
      : base_{std::move(base)}, picks_{std::make_shared<const std::vector<pick>>(std::move(picks))}, fps_{fps} {}

  [[nodiscard]] std::size_t size() const noexcept { return picks_->size(); }
  /// @pre i < size()
  [[nodiscard]] double timestamp(std::size_t i) const { return (*picks_)[i].timestamp; }
  /// Where frame `i` comes from. @pre i < size()
  [[nodiscard]] std::size_t index(std::size_t i) const { return (*picks_)[i].index; }
  [[nodiscard]] camera::camera_settings camera() const {
    camera::camera_settings settings = base_.camera();
    settings.fps = fps_;
    return settings;
  }
  /// @pre i < size()
  [[nodiscard]] se3 T_world_camera(std::size_t i) const requires posed_sequence<S> {
    return base_.T_world_camera(index(i));
  }
  [[nodiscard]] const S& base() const noexcept { return base_; }

  /// Errors: invalid_argument if there is no frame `i`, and those of the sequence chosen from.
  [[nodiscard]] result<camera::rgbd_frame> frame(std::size_t i) const {
    if (i >= size())
      return fail(errc::invalid_argument, "frame",
                  "there is no frame " + std::to_string(i) + " among " + std::to_string(size()));
    result<camera::rgbd_frame> f = base_.frame(index(i));
    if (f) f->timestamp = timestamp(i);
    return f;
  }

 private:
  S base_;
  std::shared_ptr<const std::vector<pick>> picks_;
  double fps_;
};

/// A sequence whose frames are changed: `change(frame, i)` for each that is asked for, from several threads if those
/// ask.
template <frame_sequence S, std::invocable<camera::rgbd_frame&, std::size_t> Change>
class changed {
 public:
  changed(S base, Change change) : base_{std::move(base)}, change_{std::move(change)} {}

  [[nodiscard]] std::size_t size() const { return base_.size(); }
  [[nodiscard]] double timestamp(std::size_t i) const { return base_.timestamp(i); }
  [[nodiscard]] camera::camera_settings camera() const { return base_.camera(); }
  [[nodiscard]] se3 T_world_camera(std::size_t i) const requires posed_sequence<S> { return base_.T_world_camera(i); }
  [[nodiscard]] const S& base() const noexcept { return base_; }

  /// Errors: those of the sequence underneath.
  [[nodiscard]] result<camera::rgbd_frame> frame(std::size_t i) const {
    result<camera::rgbd_frame> f = base_.frame(i);
    if (f) change_(*f, i);
    return f;
  }

 private:
  S base_;
  Change change_;
};

namespace detail {

/// Frames for which `keep(i)` holds.
template <frame_sequence S, class Keep>
[[nodiscard]] selection<S> kept(S base, double fps, const Keep& keep) {
  std::vector<typename selection<S>::pick> picks;
  for (std::size_t i = 0; i != base.size(); ++i)
    if (keep(i)) picks.push_back({i, base.timestamp(i)});
  return {std::move(base), std::move(picks), fps};
}

}  // namespace detail

/// Frames 0, n, 2n, ... @pre n > 0
template <frame_sequence S>
[[nodiscard]] selection<S> every_nth(S frames, std::size_t n) {
  assert(n > 0);
  const double fps = frames.camera().fps / static_cast<double>(n);
  return detail::kept(std::move(frames), fps, [n](std::size_t i) { return i % n == 0; });
}

/// As a camera of `fps` frames per second would have taken them: the first frame at or after each of its moments.
/// @pre fps > 0
template <frame_sequence S>
[[nodiscard]] selection<S> at_rate(S frames, double fps) {
  assert(fps > 0.0);
  const S& source = frames;
  double due = 0.0;  // in periods
  std::vector<typename selection<S>::pick> picks;
  for (std::size_t i = 0; i != source.size(); ++i) {
    const double at = (source.timestamp(i) - source.timestamp(0)) * fps;
    if (at < due - 1e-6) continue;
    picks.push_back({i, source.timestamp(i)});
    while (due <= at + 1e-6) due += 1.0;
  }
  return {std::move(frames), std::move(picks), fps};
}

/// The frames of a time span alone.
template <frame_sequence S>
[[nodiscard]] selection<S> during(S frames, time_span span) {
  const S source = frames;
  return detail::kept(std::move(frames), source.camera().fps,
                      [&](std::size_t i) { return span.contains(source.timestamp(i)); });
}

/// What becomes of the time that was cut out.
enum class gap {
  kept,   ///< time stamps stay as they are: the camera was covered, and time went by
  closed  ///< what follows comes a frame's time after what went before: nothing tells of the cut but the pictures
};

/// Without the frames of a time span: the camera has been carried on meanwhile ("kidnapped").
template <frame_sequence S>
[[nodiscard]] selection<S> without(S frames, time_span span, gap time = gap::kept) {
  const double fps = frames.camera().fps;
  double earlier = 0.0, last = 0.0;
  bool any_before = false, any_cut = false, is_moved = false;
  std::vector<typename selection<S>::pick> picks;
  for (std::size_t i = 0; i != frames.size(); ++i) {
    const double at = frames.timestamp(i);
    if (span.contains(at)) {
      any_cut = true;
      continue;
    }
    if (time == gap::closed && any_before && any_cut && !is_moved) {
      earlier = at - last - 1.0 / fps;
      is_moved = true;
    }
    if (!any_cut) any_before = true, last = at;
    picks.push_back({i, at - earlier});
  }
  return {std::move(frames), std::move(picks), fps};
}

/// Black pictures without depth for a time span: the lens is covered.
template <frame_sequence S>
[[nodiscard]] auto blacked_out(S frames, time_span span) {
  return changed{std::move(frames), [span](camera::rgbd_frame& f, std::size_t) {
                   if (!span.contains(f.timestamp)) return;
                   std::fill(f.color.pixels().begin(), f.color.pixels().end(), rgb8{});
                   std::fill(f.depth.pixels().begin(), f.depth.pixels().end(), std::uint16_t{0});
                 }};
}

/// Depth is lost for a time span, as in the sun; the pictures stay.
template <frame_sequence S>
[[nodiscard]] auto without_depth(S frames, time_span span) {
  return changed{std::move(frames), [span](camera::rgbd_frame& f, std::size_t) {
                   if (span.contains(f.timestamp))
                     std::fill(f.depth.pixels().begin(), f.depth.pixels().end(), std::uint16_t{0});
                 }};
}

/// How exposure jumps about: from time to time to another level, chosen evenly on a logarithmic scale.
struct exposure_options {
  double lowest = 0.5, highest = 1.8;  ///< the factor on grey values
  double offset = 10.0;                ///< largest value added or taken away, grey values
  double hold = 0.7;                   ///< seconds a level lasts
  std::uint64_t seed = 1;
};

ORBIS_BEGIN_UNFUSED

/// What becomes of each grey value `time` seconds after the first frame. The factor is
/// lowest * (highest / lowest)^u, to a few per cent, where `u` is even in [0, 1).
[[nodiscard]] inline std::array<std::uint8_t, 256> exposure_curve(const exposure_options& o, double time) noexcept {
  const std::uint64_t word = noise_word(o.seed, 0x67616966ULL, static_cast<std::uint64_t>(floor_to_int(time / o.hold)));
  const double u = upper_fraction(word), ratio = std::sqrt(o.highest / o.lowest);
  // Between the ends and their geometric mean, piece by piece.
  const double gain =
      u < 0.5 ? o.lowest * (1.0 + 2.0 * u * (ratio - 1.0)) : o.lowest * ratio * (1.0 + (2.0 * u - 1.0) * (ratio - 1.0));
  const double offset = o.offset * (2.0 * lower_fraction(word) - 1.0);
  std::array<std::uint8_t, 256> curve{};
  for (std::size_t v = 0; v != 256; ++v)
    curve[v] = static_cast<std::uint8_t>(std::clamp(gain * static_cast<double>(v) + offset, 0.0, 255.0) + 0.5);
  return curve;
}

ORBIS_END_UNFUSED

/// Pictures get brighter and darker in jumps and are cut off at black and white; depth stays.
/// @pre 0 < lowest <= highest, offset >= 0, hold > 0
template <frame_sequence S>
[[nodiscard]] auto with_exposure(S frames, const exposure_options& o = {}) {
  assert(o.lowest > 0.0 && o.lowest <= o.highest && o.offset >= 0.0 && o.hold > 0.0);
  const double start = frames.size() != 0 ? frames.timestamp(0) : 0.0;
  return changed{std::move(frames), [o, start](camera::rgbd_frame& f, std::size_t) {
                   const auto curve = exposure_curve(o, f.timestamp - start);
                   for (rgb8& c : f.color.pixels()) c = {curve[c.r], curve[c.g], curve[c.b]};
                 }};
}

}  // namespace orbis::test
