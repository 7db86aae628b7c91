// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/mapping/keyframe.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

struct posed_depth {  // no colours
  camera::depth_view<float> depth;
  se3 T_world_camera;
};

static_assert(mapping::keyframe_like<mapping::keyframe<>>);
static_assert(mapping::keyframe_like<mapping::keyframe<camera::depth_view<float>>>);
static_assert(!mapping::keyframe_like<posed_depth>);
static_assert(!mapping::keyframe_like<int>);
static_assert(mapping::keyframe_range<std::vector<mapping::keyframe<>>>);
static_assert(!mapping::keyframe_range<std::vector<posed_depth>>);

}  // namespace

TEST_CASE("A keyframe refers to images of its owner, colours may be absent") {
  const image<float> depth(4, 3, 2.0F);
  const mapping::keyframe<camera::depth_view<float>> k{camera::depth_view{depth}, {}, se3{}};
  CHECK(k.color.empty());
  CHECK(k.depth.width() == 4);
  CHECK(k.depth.height() == 3);
}
