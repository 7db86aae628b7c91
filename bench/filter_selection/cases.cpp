// SPDX-License-Identifier: BSD-3-Clause
#include "cases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <orbis/camera/cloud.hpp>
#include <orbis/cloud/voxel_grid.hpp>

namespace orbis::bench {

std::string_view to_string(trouble t) {
  switch (t) {
    case trouble::none: return "clean";
    case trouble::uniform_1: return "uniform 1%";
    case trouble::uniform_5: return "uniform 5%";
    case trouble::uniform_20: return "uniform 20%";
    case trouble::flying: return "flying pixels";
    case trouble::gross: return "gross range";
    case trouble::floaters: return "floaters";
    case trouble::ghosting: return "ghosting";
    case trouble::moving: return "moving object";
    case trouble::mixture: return "mixture";
    case trouble::voxel_none: return "voxel clean";
    case trouble::voxel_uniform: return "voxel uniform 5%";
    case trouble::voxel_mixture: return "voxel mixture";
    case trouble::density_none: return "density clean";
    case trouble::density_uniform: return "density uniform 5%";
  }
  return "?";
}

namespace {

/// A shot whose pixels may have been spoilt.
struct spoilt_shot {
  image<float> depth;
  image<char> touched;
  se3 T_world_camera;  ///< as the filter is told
};

/// Every pixel with a depth, with a chance, gets another one somewhere in the volume that is seen.
void add_uniform(spoilt_shot& s, double share, double max_depth, random_bits& random) {
  const double near = 0.3, far = 1.1 * max_depth;
  for (std::size_t i = 0; i != s.depth.pixels().size(); ++i) {
    const double chance = random.uniform(), where = random.uniform();
    if (s.depth.pixels()[i] == 0 || chance >= share) continue;
    s.depth.pixels()[i] =
        static_cast<float>(std::cbrt(near * near * near + where * (far * far * far - near * near * near)));
    s.touched.pixels()[i] = 1;
  }
}

/// Pixels beside a depth edge end up between its two sides, as evenly spaced in disparity.
void add_flying(spoilt_shot& s, double share, random_bits& random) {
  const image<float> before = s.depth;
  for (int y = 1; y + 1 < before.height(); ++y)
    for (int x = 1; x + 1 < before.width(); ++x) {
      const double chance = random.uniform(), f = random.uniform(0.05, 0.95);
      const float z = before(x, y);
      if (z == 0 || chance >= share) continue;
      for (const float other : {before(x - 1, y), before(x + 1, y), before(x, y - 1), before(x, y + 1)}) {
        if (other == 0 || std::abs(z - other) < 0.06F + 0.03F * std::min(z, other)) continue;
        s.depth(x, y) = static_cast<float>(1 / ((1 - f) / z + f / other));
        s.touched(x, y) = 1;
        break;
      }
    }
}

void add_gross(spoilt_shot& s, double share, random_bits& random) {
  for (std::size_t i = 0; i != s.depth.pixels().size(); ++i) {
    const double chance = random.uniform(), size = random.uniform(0.03, 0.2), sign = random.below(2) == 0 ? 1 : -1;
    const double z = s.depth.pixels()[i];
    if (z == 0 || chance >= share) continue;
    s.depth.pixels()[i] = static_cast<float>(std::max(0.2, z + sign * size * z * z));
    s.touched.pixels()[i] = 1;
  }
}

/// Small patches of the image are seen at a depth in front of the surface.
void add_floaters(spoilt_shot& s, int count, random_bits& random) {
  for (int n = 0; n != count; ++n) {
    const int size = 5 + static_cast<int>(random.below(9));
    const int x0 = static_cast<int>(random.below(static_cast<std::uint32_t>(s.depth.width() - size)));
    const int y0 = static_cast<int>(random.below(static_cast<std::uint32_t>(s.depth.height() - size)));
    const double share = random.uniform(0.3, 0.85);
    float nearest = 0;
    for (int y = y0; y != y0 + size; ++y)
      for (int x = x0; x != x0 + size; ++x)
        if (s.depth(x, y) > 0) nearest = nearest == 0 ? s.depth(x, y) : std::min(nearest, s.depth(x, y));
    for (int y = y0; y != y0 + size; ++y)
      for (int x = x0; x != x0 + size; ++x) {
        const double z = share * nearest + 0.01 * random.normal();
        const double dx = x - x0 - 0.5 * (size - 1), dy = y - y0 - 0.5 * (size - 1);
        if (s.depth(x, y) == 0 || z < 0.25 || 4 * (dx * dx + dy * dy) > size * size) continue;
        s.depth(x, y) = static_cast<float>(z);
        s.touched(x, y) = 1;
      }
  }
}

void spoil_pose(spoilt_shot& s, random_bits& random) {
  const auto direction = [&] { return vec3{random.normal(), random.normal(), random.normal()}.normalized(); };
  const vec3 turn = direction() * random.uniform(0.01, 0.05), shift = direction() * random.uniform(0.05, 0.14);
  s.T_world_camera = s.T_world_camera * se3{so3::exp(turn), shift};
  std::fill(s.touched.pixels().begin(), s.touched.pixels().end(), char{1});
}

/// Somebody stands in the way of some of the views.
void add_walker(std::vector<spoilt_shot>& shots, const surface& surface, random_bits& random) {
  room scene = surface.scene;
  std::vector<se3> path;
  for (const auto& shot : surface.shots) path.push_back(shot.T_world_camera);
  const std::uint64_t seed = random();
  const camera::pinhole camera = surface.sensor.camera();
  for (std::size_t i = 0; i != shots.size(); ++i) {
    if (scene.solids.empty()) scene.kind = room_kind::furnished;
    const room body{scene.kind,
                    {walker(scene, path, (static_cast<double>(i) + 0.5) / static_cast<double>(shots.size()), seed)}};
    const se3& pose = shots[i].T_world_camera;
    for (int y = 0; y != camera.height(); ++y)
      for (int x = 0; x != camera.width(); ++x) {
        const float behind = shots[i].depth(x, y);
        const double z = body.cast(pose.translation(), pose.rotation() * *camera.unproject({x, y}));
        if (behind == 0 || z == 0 || z >= behind - 0.02) continue;
        shots[i].depth(x, y) = surface.sensor.measure(z, random);
        shots[i].touched(x, y) = 1;
      }
  }
}

/// A set of points that are kept whatever the density elsewhere.
std::vector<vec3> dense_regions(const std::vector<spoilt_shot>& shots, const camera::pinhole& camera,
                                random_bits& random) {
  std::vector<vec3> centres;
  while (centres.size() != 3) {
    const auto& s = shots[random.below(static_cast<std::uint32_t>(shots.size()))];
    const auto x = static_cast<int>(random.below(static_cast<std::uint32_t>(camera.width())));
    const auto y = static_cast<int>(random.below(static_cast<std::uint32_t>(camera.height())));
    const double z = s.depth(x, y);
    if (z > 0) centres.push_back(s.T_world_camera * (z * *camera.unproject({x, y})));
  }
  return centres;
}

bool is_voxel(trouble t) {
  return t == trouble::voxel_none || t == trouble::voxel_uniform || t == trouble::voxel_mixture;
}
bool is_density(trouble t) { return t == trouble::density_none || t == trouble::density_uniform; }

void spoil(std::vector<spoilt_shot>& shots, trouble kind, const surface& surface, random_bits& random) {
  const std::size_t ghosts = std::max<std::size_t>(1, shots.size() / 4);
  for (std::size_t i = 0; i != shots.size(); ++i) {
    spoilt_shot& s = shots[i];
    switch (kind) {
      case trouble::uniform_1: add_uniform(s, 0.01, surface.sensor.max_depth, random); break;
      case trouble::uniform_5:
      case trouble::voxel_uniform:
      case trouble::density_uniform: add_uniform(s, 0.05, surface.sensor.max_depth, random); break;
      case trouble::uniform_20: add_uniform(s, 0.20, surface.sensor.max_depth, random); break;
      case trouble::flying: add_flying(s, 0.5, random); break;
      case trouble::gross: add_gross(s, 0.03, random); break;
      case trouble::floaters: add_floaters(s, 6, random); break;
      case trouble::ghosting:
        if ((i + surface.seed) % (shots.size() / ghosts) == 0) spoil_pose(s, random);
        break;
      case trouble::mixture:
      case trouble::voxel_mixture:
        add_flying(s, 0.3, random);
        add_floaters(s, 2, random);
        add_gross(s, 0.01, random);
        add_uniform(s, 0.02, surface.sensor.max_depth, random);
        break;
      case trouble::none:
      case trouble::voxel_none:
      case trouble::density_none:
      case trouble::moving: break;
    }
  }
  if (kind == trouble::moving) add_walker(shots, surface, random);
}

/// Merged into voxels; the majority decides on the label.
void merge(labelled_case& c, double size) {
  std::map<std::array<double, 3>, std::size_t> numbers;  // in the order of first sight, as those of voxel_grid
  std::vector<std::array<int, 3>> votes;
  std::vector<float> ranges;
  for (std::size_t i = 0; i != c.points.size(); ++i) {
    std::array<double, 3> cell{};
    for (std::size_t a = 0; a != 3; ++a)
      cell[a] = std::floor(static_cast<double>(c.points[i][static_cast<Eigen::Index>(a)]) * (1.0 / size));
    const std::size_t number = numbers.try_emplace(cell, votes.size()).first->second;
    if (number == votes.size()) votes.emplace_back(), ranges.push_back(c.ranges[i]);
    ++votes[number][static_cast<std::size_t>(c.labels[i])];
    ranges[number] = std::min(ranges[number], c.ranges[i]);
  }
  c.points = cloud::voxel_grid(c.points, {.size = size}).points;
  c.ranges = std::move(ranges);
  c.labels.clear();
  for (const auto& v : votes) {
    c.labels.push_back(v[0] > v[1] + v[2] ? label::clean : v[1] > v[0] + v[2] ? label::outlier : label::unsure);
  }
}

}  // namespace

bool applies(trouble kind, const surface& s) {
  const bool needs_views = kind == trouble::ghosting || kind == trouble::moving;
  return !needs_views || (s.context == known::views && s.shots.size() >= 4);
}

labelled_case make_case(const surface& s, trouble kind) {
  random_bits random{mix64(s.seed ^ mix64(static_cast<std::uint64_t>(kind) + 77))};
  labelled_case c;
  c.source = s.name;
  c.kind = kind;
  c.context = s.context;
  c.camera = s.sensor.camera();
  if (s.exact) c.distance = s.distance;
  std::vector<spoilt_shot> shots;
  for (const auto& shot : s.shots) {
    shots.push_back({shot.depth, image<char>(shot.depth.width(), shot.depth.height()), shot.T_world_camera});
  }
  if (is_density(kind) && !s.close_up.depth.empty()) {
    shots.push_back({s.close_up.depth, image<char>(s.close_up.depth.width(), s.close_up.depth.height()),
                     s.close_up.T_world_camera});
  }
  spoil(shots, kind, s, random);

  const auto regions = is_density(kind) ? dense_regions(shots, c.camera, random) : std::vector<vec3>{};
  const camera::ray_table rays{c.camera};
  for (const spoilt_shot& shot : shots) {
    const auto seen = camera::unproject_depth(seq, camera::depth_view<float>(shot.depth), rays);
    const auto judge = [&](int x, int y, const vec3f& p) {
      const vec3 world = shot.T_world_camera * p.cast<double>();
      const bool on_grid = x % s.stride == 0 && y % s.stride == 0;
      if (!regions.empty()) {
        const bool dense =
            std::any_of(regions.begin(), regions.end(), [&](const vec3& r) { return (world - r).norm() < 0.35; });
        if (!dense && random.below(12) != 0) return;
      } else if (!on_grid) {
        return;
      }
      c.points.push_back(world.cast<float>());
      c.ranges.push_back(p.norm());
      label l = label::clean;
      if (shot.touched(x, y) != 0) {
        const double z = p.z();
        const double off = s.distance(c.points.back().cast<double>());
        l = off > std::max(0.02, 4 * s.sensor.deviation(z)) ? label::outlier : label::unsure;
      }
      c.labels.push_back(l);
    };
    const auto width = static_cast<std::uint32_t>(rays.width());
    for (std::size_t i = 0; i != seen.points.size(); ++i)
      judge(static_cast<int>(seen.pixels[i] % width), static_cast<int>(seen.pixels[i] / width), seen.points[i]);
  }
  if (is_voxel(kind)) merge(c, 0.015 + 0.005 * static_cast<double>(s.seed % 5));
  if (s.context == known::views) {
    for (spoilt_shot& shot : shots) c.images.push_back(std::move(shot.depth));
    for (std::size_t i = 0; i != shots.size(); ++i) {
      c.views.push_back({camera::depth_view<float>(c.images[i]), shots[i].T_world_camera});
    }
  }
  if (s.context == known::points) c.ranges.clear();
  return c;
}

surface make_surface(const synthetic_source& source) {
  surface s;
  s.scene = make_room(source.kind, source.seed);
  constexpr std::array names{"furnished", "clutter", "corridor", "table", "hall"};
  s.name = std::string{names[static_cast<std::size_t>(source.kind)]} + " " + std::to_string(source.seed);
  s.context = source.context;
  s.sensor = source.sensor;
  s.seed = source.seed;
  s.stride = source.views < 3 ? 1 : 2;
  random_bits random{mix64(source.seed ^ 0x6e6f697365ULL)};
  const camera::pinhole camera = s.sensor.camera();
  const auto shoot = [&](const se3& pose) {
    surface::shot shot{image<float>(camera.width(), camera.height()), pose};
    for (int y = 0; y != camera.height(); ++y)
      for (int x = 0; x != camera.width(); ++x) {
        const double z = s.scene.cast(pose.translation(), pose.rotation() * *camera.unproject({x, y}));
        shot.depth(x, y) = s.sensor.measure(z, random);
      }
    return shot;
  };
  const auto path = make_path(s.scene, source.views, source.seed);
  for (const se3& pose : path) s.shots.push_back(shoot(pose));
  const se3& first = path.front();
  const double ahead = s.scene.cast(first.translation(), first.rotation_matrix().col(2));
  s.close_up = shoot(first * se3{so3{}, vec3{0, 0, std::max(0.0, ahead - 0.6)}});
  s.distance = [scene = s.scene](const vec3& p) { return scene.distance(p); };
  return s;
}

std::vector<surface> surfaces_of(const std::string& set, const std::filesystem::path& data) {
  using enum room_kind;
  const bool judging = set == "judging";
  const auto synthetic = judging ? std::vector<synthetic_source>{
    {furnished, 901, {.noise_floor = 0.0012, .noise_square = 0.0019, .disparity_step = 0.125}, 8, known::views},
    {furnished, 902, {.width = 224, .height = 168, .focal = 200, .noise_square = 0.0035, .max_depth = 6.0}, 5, known::ranges},
    {corridor, 903, {.noise_floor = 0.002, .noise_square = 0.0008, .max_depth = 8.0}, 7, known::views},
    {corridor, 904, {.noise_square = 0.003, .disparity_step = 0.2, .max_depth = 5.0}, 6, known::points},
    {table_top, 905, {.width = 200, .height = 150, .focal = 170, .noise_floor = 0.0008, .noise_square = 0.0015}, 8, known::views},
    {table_top, 906, {.noise_floor = 0.0005, .noise_square = 0.001}, 1, known::ranges},
    {hall, 907, {.noise_floor = 0.003, .noise_square = 0.0005, .max_depth = 9.0}, 6, known::points},
    {furnished, 908, {.width = 256, .height = 192, .focal = 210, .noise_square = 0.0028, .disparity_step = 0.125, .max_depth = 4.0}, 1, known::ranges},
    {hall, 909, {.noise_square = 0.0022, .max_depth = 7.0}, 9, known::views},
  } : std::vector<synthetic_source>{
    {furnished, 11, {.noise_floor = 0.0015, .noise_square = 0.0025}, 8, known::views},
    {furnished, 12, {.width = 160, .height = 120, .focal = 140, .noise_square = 0.0015, .disparity_step = 0.1, .max_depth = 5.0}, 6, known::ranges},
    {clutter, 13, {.noise_floor = 0.0005, .noise_square = 0.001, .max_depth = 5.5}, 6, known::points},
    {clutter, 14, {.width = 176, .height = 132, .focal = 150, .noise_square = 0.004, .max_depth = 4.0}, 10, known::views},
    {clutter, 15, {.width = 240, .height = 180, .focal = 190, .noise_square = 0.0018, .max_depth = 5.0}, 1, known::ranges},
    {corridor, 16, {.noise_square = 0.0015, .max_depth = 6.5}, 5, known::ranges},
    {hall, 17, {.noise_floor = 0.002, .noise_square = 0.001, .disparity_step = 0.15, .max_depth = 6.5}, 7, known::views},
    {table_top, 18, {.noise_floor = 0.001, .noise_square = 0.002}, 6, known::points},
    {furnished, 19, {.noise_floor = 0.004, .noise_square = 0.0, .max_depth = 6.0}, 1, known::points},
  };
  const auto real = judging ? std::vector<real_source>{{"kitchen", 20, 12, 8, known::views},
                                                       {"kitchen", 300, 15, 6, known::ranges},
                                                       {"kitchen", 180, 10, 5, known::points},
                                                       {"sevenscenes_raw", 0, 3, 3, known::ranges}}
                            : std::vector<real_source>{{"livingroom", 0, 8, 8, known::views},
                                                       {"livingroom", 120, 8, 6, known::points},
                                                       {"fr1_desk_9", 0, 2, 4, known::ranges}};
  std::vector<surface> out;
  for (const auto& s : synthetic) out.push_back(make_surface(s));
  for (const auto& r : real) {
    for (surface& s : real_surface(data, r)) out.push_back(std::move(s));
  }
  return out;
}

}  // namespace orbis::bench
