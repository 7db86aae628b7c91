// SPDX-License-Identifier: BSD-3-Clause
//
// The system with another camera, descriptor, distance, extractor and recogniser of places, with the headers that
// docs/tutorials/your_types.md names for it.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <type_traits>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/pnp-inl.hpp>
#include <orbis/optimize/pose_refinement-inl.hpp>
#include <orbis/slam/system-inl.hpp>
#include <orbis/slam/system.hpp>

#include "slam/known_places.hpp"
#include "support/catch.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

/// A camera of which the library knows nothing.
struct own_camera {
  camera::pinhole inner;

  [[nodiscard]] int width() const { return inner.width(); }
  [[nodiscard]] int height() const { return inner.height(); }
  [[nodiscard]] std::optional<vec2> project(const vec3& p) const { return inner.project(p); }
  [[nodiscard]] std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) const {
    return inner.project(p, jacobian);
  }
  [[nodiscard]] std::optional<vec3> unproject(const vec2& pixel) const { return inner.unproject(pixel); }
};
static_assert(camera::camera_model<own_camera>);

/// How many bits are set in each of 32 parts of 8 bits of the descriptor of ORB.
struct histogram {
  std::array<std::uint8_t, 32> counts{};
};

/// The sum of absolute differences.
struct histogram_distance {
  [[nodiscard]] std::uint32_t operator()(const histogram& a, const histogram& b) const noexcept {
    int sum = 0;
    for (std::size_t i = 0; i != a.counts.size(); ++i) sum += std::abs(int{a.counts[i]} - int{b.counts[i]});
    return static_cast<std::uint32_t>(sum);
  }
};

}  // namespace

template <>
struct orbis::slam::distance_of<histogram> {
  using type = histogram_distance;
};

namespace {

struct histogram_extractor {
  features::orb_extractor orb;

  [[nodiscard]] features::basic_features<histogram> operator()(image_view<const rgb8> image) const {
    features::features found = orb(image);
    features::basic_features<histogram> f;
    for (const auto& d : found.descriptors) {
      histogram h;
      for (std::size_t bit = 0; bit != 256; ++bit)
        h.counts[bit / 8] = static_cast<std::uint8_t>(h.counts[bit / 8] + (d.bit(bit) ? 1 : 0));
      f.descriptors.push_back(h);
    }
    f.keypoints = std::move(found.keypoints);
    return f;
  }
};

using matchers = slam::distance_matchers<histogram_distance, 40, 32, 32>;
using system_type = slam::rgbd_system<own_camera, histogram_extractor, matchers, test::known_places>;

static_assert(slam::feature_extractor<histogram_extractor> && !slam::feature_extractor<int>);
static_assert(std::is_same_v<slam::descriptor_of_t<histogram_extractor>, histogram>);
static_assert(std::is_same_v<slam::descriptor_of_t<features::orb_extractor>, features::binary_descriptor<256>>);
static_assert(std::is_same_v<decltype(slam::basic_landmark<histogram>{}.descriptor), histogram>);
static_assert(slam::tracking_matchers<matchers, histogram> && !slam::tracking_matchers<slam::orb_matchers, histogram>);

// The type of the system follows from the arguments of its constructor.
struct sparse_extractor {
  [[nodiscard]] features::features operator()(image_view<const rgb8> image) const;
};
using deduced = decltype(slam::rgbd_system{std::declval<camera::pinhole>(), slam::options{},
                                           std::declval<sparse_extractor>()});
static_assert(std::is_same_v<deduced, slam::rgbd_system<camera::pinhole, sparse_extractor>>);

// Files hold the descriptors of ORB alone.
template <class S>
concept saves_maps = requires(const S& s) {
  s.save_map("x");
};
static_assert(!saves_maps<system_type> && saves_maps<slam::rgbd_system<camera::any_camera>>);

}  // namespace

TEST_CASE("A system with another camera, descriptor, distance and extractor tracks a recording and maps it") {
  const io::synthetic_recording recording{{.frames = 24, .seed = 5, .width = 320, .height = 240, .frames_around = 300}};
  slam::options o;
  o.triangulation.distance = 16;
  o.fusion.distance = 18;
  o.places.loop.distance = 24;
  o.places.loop.landmark_distance = 18;
  o.places.correction.fusion.distance = 18;
  o.initial_pose = recording.frame(0).value().T_world_camera;
  system_type slam{own_camera{camera::pinhole{recording.camera().model.k()}}, o,
                   histogram_extractor{features::orb_extractor{o.features}}};
  double worst = 0.0;
  for (std::size_t i = 0; i != recording.size(); ++i) {
    const auto f = recording.frame(i).value();
    const auto r = slam.track(f);
    REQUIRE(r.tracked());
    worst = std::max(worst, (r.T_world_camera->translation() - f.T_world_camera->translation()).norm());
  }
  CHECK(worst < 0.03);
  CHECK(slam.keyframes().size() >= 2);
  CHECK(slam.landmark_count() > 200);
  const auto valid = test::validate(slam.map());
  CHECK((valid ? "" : valid.error().to_string()) == "");
}

TEST_CASE("A system takes its features from the extractor that it is given, not from its options") {
  const io::synthetic_recording recorded{{.frames = 10, .seed = 5, .width = 320, .height = 240, .frames_around = 300}};
  system_type slam{own_camera{camera::pinhole{recorded.camera().model.k()}}, slam::options{},
                   histogram_extractor{features::orb_extractor{{.max_features = 400}}}};
  for (const auto& f : recorded) CHECK(slam.track(f).tracked());
  CHECK(slam.map().keyframes().front().size() <= 400);
}
