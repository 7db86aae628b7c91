// SPDX-License-Identifier: BSD-3-Clause
#include "navigation_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <orbis/nav/floor_cost.hpp>

#include "sheet.hpp"

namespace app {
namespace {

using orbis::rgb8;
using orbis::vec2;
using orbis::vec3;
using orbis::octree::occupancy;

constexpr rgb8 dark{28, 32, 40}, nothing{205, 206, 208};
constexpr rgb8 white{255, 255, 255}, costly{250, 190, 140}, too_near{235, 150, 120};  // on the floor
constexpr rgb8 at_obstacle{120, 60, 140}, far_off{235, 245, 250};                     // in the slice

rgb8 mixed(rgb8 a, rgb8 b, double t) {
  const auto byte = [&](std::uint8_t u, std::uint8_t v) {
    return static_cast<std::uint8_t>(std::lround(u + std::clamp(t, 0.0, 1.0) * (v - u)));
  };
  return {byte(a.r, b.r), byte(a.g, b.g), byte(a.b, b.b)};
}
/// The colour of a cost: white in free space far from obstacles, orange next to them.
rgb8 cost_color(std::uint8_t cost) {
  namespace cost_of = orbis::nav::floor_cost;
  if (cost == cost_of::lethal) return dark;
  if (cost == cost_of::no_information) return nothing;
  if (cost == cost_of::inscribed) return too_near;
  return mixed(white, costly, cost / 252.0);
}
rgb8 distance_color(double share) { return mixed(at_obstacle, far_off, std::sqrt(std::max(0.0, share))); }

/// An entry of the legend: a colour and its meaning.
struct meaning {
  rgb8 color;
  std::string text;
};

/// Extent of a view from above, metres.
struct window {
  vec2 low, high;
};

/// The window around the floor map, or around all known space.
window find_window(const navigation_picture& what) {
  if (what.floor != nullptr) {
    const auto& f = *what.floor;
    return {f.origin, f.origin + f.resolution * vec2(f.states.width(), f.states.height())};
  }
  window w{vec2::Constant(1e9), vec2::Constant(-1e9)};
  what.map.for_each_leaf([&](const auto& leaf) {
    const vec2 c = leaf.center.template head<2>(), half = vec2::Constant(0.5 * leaf.size);
    w = {w.low.cwiseMin(c - half), w.high.cwiseMax(c + half)};
  });
  if (!(w.low.array() <= w.high.array()).all()) w = {vec2::Zero(), vec2::Ones()};
  return w;
}

/// Draws the window; the colour of a pixel is determined by the position of its centre.
template <class ColorAt>
orbis::image<rgb8> draw(const window& w, int width, int height, const ColorAt& color_at) {
  orbis::image<rgb8> out(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x)
      out(x, y) = color_at(vec2(w.low.x() + (x + 0.5) / width * (w.high.x() - w.low.x()),
                                w.high.y() - (y + 0.5) / height * (w.high.y() - w.low.y())));
  return out;
}

orbis::image<rgb8> draw_floor(const navigation_picture& what, const window& w, int width, int height) {
  const auto costs = orbis::nav::inflate(*what.floor, {.radius = what.radius});
  return draw(w, width, height, [&](const vec2& p) {
    const auto cell = what.floor->cell(p);
    return cell ? cost_color(costs((*cell)[0], (*cell)[1])) : nothing;
  });
}
/// The largest distance in the slice, metres; the floor counts as an obstacle.
double largest_distance(const navigation_picture& what) {
  constexpr double least = 0.1;  // more than the noise of the floor
  const double reach = what.field->reach();
  const double above_floor = what.floor != nullptr ? what.height - what.floor->floor : reach;
  return above_floor > least ? std::min(reach, above_floor) : reach;
}
orbis::image<rgb8> draw_slice(const navigation_picture& what, const window& w, int width, int height) {
  const double largest = largest_distance(what);
  return draw(w, width, height, [&](const vec2& xy) {
    const vec3 p{xy.x(), xy.y(), what.height};
    switch (what.map.state(p)) {
      case occupancy::occupied: return dark;
      case occupancy::unknown: return nothing;
      case occupancy::free: break;
    }
    return distance_color(std::min(what.field->distance(p) / largest, 1.0));
  });
}

}  // namespace

orbis::result<void> write_navigation_picture(const navigation_picture& what, const std::filesystem::path& path) {
  cv::setNumThreads(0);
  const window w = find_window(what);
  const vec2 size = (w.high - w.low).cwiseMax(1e-3);
  const int panels = (what.floor != nullptr ? 1 : 0) + (what.field != nullptr ? 1 : 0);
  constexpr double left = 80, top = 130, most_across = 640, most_down = 620, gap = 100;
  const double scale = std::min(most_across / size.x(), most_down / size.y());  // pixels per metre
  const int width = std::max(1, static_cast<int>(scale * size.x())),
            height = std::max(1, static_cast<int>(scale * size.y()));

  sheet s{1500, static_cast<int>(top) + height + 100};
  s.text(what.title, {60, 44}, ink, 19, 0.0, true);
  s.text(what.subtitle, {60, 70}, faint, 13);
  const auto panel = [&](double x, const std::string& title, const orbis::image<rgb8>& picture, bool has_path,
                         const std::vector<meaning>& colors) {
    axes a{s,
           x,
           top,
           static_cast<double>(width),
           static_cast<double>(height),
           {w.low.x(), w.high.x()},
           {w.low.y(), w.high.y()},
           false};
    a.frame(title, "x, m", "y, m");
    s.paste(picture, static_cast<int>(x), static_cast<int>(top));
    vec2 entry{x, top + height + 66};
    for (const meaning& m : colors) entry = s.legend(entry, m.color, m.text);
    s.legend(s.legend(entry, dark, "occupied"), nothing, "unknown");
    if (!has_path || what.path.empty()) return;
    s.legend(s.legend(s.legend({x, entry.y() + 20}, start_color, "start"), error_color, "goal"), estimate_color,
             "path");
    std::vector<vec2> way;
    for (const vec3& p : what.path) way.emplace_back(p.x(), p.y());
    a.curve(way, estimate_color, 2.4);
    s.dot(a.place(way.front().x(), way.front().y()), start_color, 5.0);
    s.dot(a.place(way.back().x(), way.back().y()), error_color, 5.0);
  };
  char text[160];
  double x = panels == 1 ? 0.5 * (1500 - width) : left;
  if (what.floor != nullptr) {
    std::snprintf(text, sizeof text, "floor at %.2f m", what.floor->floor);
    panel(x, text, draw_floor(what, w, width, height), what.field == nullptr || what.drives,
          {{white, "free"}, {costly, "near an obstacle"}, {too_near, "too near for the robot"}});
    x += most_across + gap;
  }
  if (what.field != nullptr) {
    const double largest = largest_distance(what);
    std::snprintf(text, sizeof text, "clearance at a height of %.2f m, 0 to %.2f m", what.height, largest);
    panel(x, text, draw_slice(what, w, width, height), what.floor == nullptr || !what.drives,
          {{at_obstacle, "next to obstacles, floor or unknown space"}, {far_off, "far from all"}});
  }
  return s.write(path);
}

}  // namespace app
