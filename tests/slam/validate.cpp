// SPDX-License-Identifier: BSD-3-Clause
#include "support/validate.hpp"

#include <limits>
#include <string>
#include <utility>

#include <orbis/core/random.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

using content = slam::detail::map_content<features::binary_descriptor<256>>;

/// What is found wrong with a map of four keyframes after `damage(parts)`.
template <class Damage>
[[nodiscard]] std::string fault_after(Damage&& damage) {
  random_bits random(7);
  slam::map m(8, 1.2);
  for (int i = 0; i < 5; ++i) test::add_random_keyframe(random, m, 20, 8);
  m.fuse(m.at(4).landmarks[0], m.at(0).landmarks[0]);
  m.erase_keyframe(2);
  content parts = m.content();
  damage(parts);
  return test::fault_of(slam::map{std::move(parts)});
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("A whole map has no fault") {
  CHECK(fault_after([](auto&) {}) == "");
  CHECK(test::fault_of(slam::map{}) == "");
}

TEST_CASE("What is wrong is said in words") {
  using parts = content;
  CHECK(fault_after([](parts& p) { p.keyframes[1].id = 3; }) == "keyframe 1: calls itself 3");
  CHECK(fault_after([](parts& p) { p.keyframes[1].depth.pop_back(); }) ==
        "keyframe 1: does not have one descriptor, depth, ray and landmark for each keypoint");
  CHECK(fault_after([](parts& p) { p.keyframes[3].T_world_camera = se3(so3{}, vec3(0, not_a_number, 0)); }) ==
        "keyframe 3: has a pose that is not finite");
  CHECK(fault_after([](parts& p) { p.keyframes[3].scale = not_a_number; }) == "keyframe 3: has a scale that is none");
  CHECK(fault_after([](parts& p) {
          p.keyframes[1].depth[2] = 1.0F;
          p.keyframes[1].rays[2].setConstant(not_a_number);
        }) == "keyframe 1: has depth at keypoint 2, which has no ray");
  CHECK(fault_after([](parts& p) { p.landmarks[1].observations.clear(); }) == "landmark 1: is seen by no keyframe");
  CHECK(fault_after([](parts& p) { p.landmarks[1].position.z() = not_a_number; }) ==
        "landmark 1: is at no finite place");
  CHECK(fault_after([](parts& p) { p.landmarks[1].created = 99; }) ==
        "landmark 1: comes from a keyframe that never was");
  CHECK(fault_after([](parts& p) {
          for (auto& [id, e] : p.erased) e.T_replacement_camera = se3(so3{}, vec3(not_a_number, 0, 0));
        }) == "keyframe 2: was at no finite place");
  CHECK(fault_after([](parts& p) { p.erased.clear(); }) == "keyframes: are gone, and where they were is not known");
  CHECK(fault_after([](parts& p) { p.erased[9] = {}; }) == "keyframes: are remembered as erased that never were");
  CHECK(fault_after([](parts& p) { p.tree = {}; }) == "tree: does not have all keyframes");
  CHECK(fault_after([](parts& p) {
          const auto nothing = [](auto, auto) { return 0U; };
          p.tree.erase(4, nothing);
          p.tree.add(9, 0);
        }) == "keyframe 0: has the child 9, which is not there");
}

TEST_CASE("Observations that disagree are found") {
  // Of a keypoint that shows another landmark, of a keyframe twice.
  CHECK_FALSE(fault_after([](content& p) { p.landmarks[1].observations.front().feature ^= 1U; }) == "");
  CHECK_FALSE(fault_after([](content& p) {
                auto& all = p.landmarks[1].observations;
                all.insert(all.begin(), all.front());
              }) == "");
}
