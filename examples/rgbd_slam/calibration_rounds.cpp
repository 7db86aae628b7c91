// SPDX-License-Identifier: BSD-3-Clause
#include "calibration_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include <orbis/camera/parameters.hpp>
#include <orbis/slam/system.hpp>

#include "interrupts.hpp"
#include "slam_options.hpp"

namespace app {
namespace {

using orbis::camera::any_camera;
using calibration = orbis::slam::calibration<any_camera>;

struct refined {
  calibration camera;
  orbis::trajectory trajectory;
  std::optional<lens_comparison> lens;
};

/// Returns true if another round would change nothing.
bool is_last_round(const calibration& c) { return is_settled(c, 1.0); }

/// Tracks all frames with `model` and calibrates it with the largest map. `is_last`: no other round follows.
orbis::result<refined> refine(const any_camera& model, const frame_source& source, const settings& s,
                              const orbis::camera::shutter& shutter, const calibration_limits& limits, bool is_last,
                              console& console) {
  orbis::slam::options options = slam_options(model, source.camera.baseline);
  options.shutter = shutter;
  orbis::slam::rgbd_system<any_camera> slam{model, options};
  read_ahead frames{source, s.threads != 1};
  std::optional<double> begin;
  const auto cancelled = [&] { return orbis::fail(orbis::errc::cancelled, s.input.string(), "interrupted"); };
  for (std::size_t i = 0; frames.has_next(); ++i) {
    if (interrupts::stop_requested()) return cancelled();
    const auto frame = frames.next();
    if (!frame) return orbis::fail(frame.error());
    if (!begin) begin = frame->timestamp;
    if (frame->timestamp - *begin > limits.longest) break;
    slam.track(*frame);
    console.advance(i + 1, source.frames, "tracking");
  }
  const orbis::slam::map_id map = slam.largest_map();
  orbis::trajectory poses = slam.trajectory(map);
  if (poses.empty()) return orbis::fail(orbis::errc::no_data, s.input.string(), "tracking never started");
  const auto go_on = [&, show = console.progress()](std::size_t done, std::size_t total) {
    return show(done, total) && !interrupts::stop_requested();
  };
  const auto found = slam.inspect([&](const orbis::slam::atlas& maps) {
    return orbis::slam::calibrate(maps.at(map), orbis::slam::make_rig(model, options), {}, go_on);
  });
  if (interrupts::stop_requested()) return cancelled();
  if (!found) return orbis::fail(orbis::errc::degenerate, s.input.string(), found.error().message);
  std::optional<lens_comparison> lens;
  if (limits.compares_lens && (is_last || is_last_round(*found)))
    lens = slam.inspect(
        [&](const orbis::slam::atlas& maps) { return compare_lens(maps.at(map), model, *found, options, {}); });
  return refined{*found, std::move(poses), lens};
}

/// The parameters of a camera, indexed by their names.
using parameter_table = std::map<std::string_view, double>;

parameter_table make_table(const any_camera& camera) {
  return camera.visit([](const auto& model) {
    using of_model = orbis::camera::parameters_of<std::remove_cvref_t<decltype(model)>>;
    const auto values = of_model::get(model);
    parameter_table table;
    for (int i = 0; i != of_model::count; ++i) table[of_model::names[static_cast<std::size_t>(i)]] = values[i];
    return table;
  });
}

/// `camera` with the parameters in the table; unchanged if these are invalid.
any_camera with_parameters(const any_camera& camera, const parameter_table& table) {
  return camera.visit([&](const auto& model) -> any_camera {
    using of_model = orbis::camera::parameters_of<std::remove_cvref_t<decltype(model)>>;
    auto values = of_model::get(model);
    for (int i = 0; i != of_model::count; ++i)
      if (const auto at = table.find(of_model::names[static_cast<std::size_t>(i)]); at != table.end())
        values[i] = at->second;
    const auto changed = of_model::with(model, values);
    return changed ? any_camera{*changed} : camera;
  });
}

/// The calibrated camera, with held parameters reset to the given values instead of the values of an earlier round.
any_camera with_held_as_given(calibration& found, const parameter_table& given) {
  parameter_table held;
  for (auto& p : found.parameters)
    if (p.is_held) p.after = held[p.name] = given.at(p.name);
  return with_parameters(found.camera, held);
}

}  // namespace

bool is_settled(const calibration& c, double deviations) {
  return std::all_of(c.parameters.begin(), c.parameters.end(), [&](const orbis::slam::calibrated_parameter& p) {
    return std::abs(p.after - p.before) <= deviations * p.deviation;  // both 0 for held parameters
  });
}

orbis::result<calibration_rounds> calibrate_by(const frame_source& source, const settings& s,
                                               const orbis::camera::shutter& shutter, const any_camera& given,
                                               const calibration_limits& limits, console& console) {
  const parameter_table given_values = make_table(given);
  any_camera camera = given;
  calibration_rounds rounds;
  for (int round = 1; round <= limits.most_rounds && !(round > 1 && is_last_round(rounds.last)); ++round) {
    console.stage("calibrating");
    auto next = refine(camera, source, s, shutter, limits, round == limits.most_rounds, console);
    if (!next) return orbis::fail(next.error());
    rounds.last = std::move(next->camera);
    rounds.trajectory = std::move(next->trajectory);
    rounds.lens = next->lens;
    rounds.last.camera = camera = with_held_as_given(rounds.last, given_values);
    char text[160];
    std::snprintf(text, sizeof text, "round %d: %zu keyframes, %zu observations, error %.3f -> %.3f std. deviations",
                  round, rounds.last.keyframes, rounds.last.observations, rounds.last.initial_rms,
                  rounds.last.final_rms);
    console.finish(text);
  }
  rounds.parameters = rounds.last.parameters;
  for (auto& p : rounds.parameters) p.before = given_values.at(p.name);
  return rounds;
}

}  // namespace app
