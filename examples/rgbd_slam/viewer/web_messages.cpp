// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/web_messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include <orbis/io/jpeg.hpp>

namespace app {
namespace {

static_assert(std::endian::native == std::endian::little, "the viewer's messages need a little-endian machine");

constexpr int jpeg_quality = 75;

template <class T>
void append(std::string& bytes, T value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

void append_count(std::string& bytes, std::size_t count) { append(bytes, static_cast<std::uint32_t>(count)); }

nlohmann::json to_json(const orbis::se3& T) {
  nlohmann::json rows = nlohmann::json::array();
  const auto m = T.to_matrix();
  for (int r = 0; r != 3; ++r)
    for (int c = 0; c != 4; ++c) rows.push_back(m(r, c));
  return rows;
}

}  // namespace

std::string state_json(const viewer_scene& scene, std::uint64_t session) {
  nlohmann::json camera = nlohmann::json::array();
  for (const orbis::vec3f& ray : scene.camera) camera.push_back({ray.x(), ray.y(), ray.z()});
  const shown_numbers& n = scene.numbers;
  nlohmann::json state{
      {"session", session},
      {"title", scene.title},
      {"camera", std::move(camera)},
      {"over", scene.is_over},
      {"graph", scene.graph.revision},
      {"keyframes", scene.graph.keyframes.size()},
      {"voxels", {{"revision", scene.voxels.revision}, {"count", scene.voxels.count}, {"absent", scene.voxels.absent}}},
      {"frames", n.frames},
      {"tracking_ms", n.tracking_ms},
      {"tracking_p95_ms", n.tracking_p95_ms},
      {"insertions", n.insertions},
      {"insert_ms", n.insert_ms},
      {"insert_p95_ms", n.insert_p95_ms},
      {"behind_frames", n.behind_frames},
      {"corrections", n.corrections},
      {"correction_ms", n.correction_ms}};
  if (const auto& f = scene.frame) {
    const auto tracked = std::count_if(f->features.begin(), f->features.end(), [](const auto& p) { return p.tracked; });
    state["frame"] = {{"number", f->number},
                      {"state", f->state},
                      {"width", f->image->width()},
                      {"height", f->image->height()},
                      {"features", f->features.size()},
                      {"tracked", tracked}};
    if (f->T_world_camera) state["frame"]["T_world_camera"] = to_json(*f->T_world_camera);
  }
  return state.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);  // a title may be invalid UTF-8
}

std::string frame_message(const std::string& json, const shown_frame* frame) {
  std::string bytes;
  append_count(bytes, json.size());
  bytes += json;
  if (frame == nullptr) return append_count(bytes, 0), bytes;
  append_count(bytes, frame->features.size());
  const auto eighths = [](float pixels) {
    return static_cast<std::uint16_t>(std::clamp(std::lround(8.0F * pixels), 0L, 65535L));
  };
  for (const shown_feature& f : frame->features) {
    append(bytes, eighths(f.x));
    append(bytes, eighths(f.y));
    append(bytes, static_cast<std::uint16_t>(f.tracked ? 1 : 0));
  }
  if (const auto jpeg = orbis::io::encode_jpeg(*frame->image, jpeg_quality)) bytes += *jpeg;
  return bytes;
}

std::string graph_message(const shown_graph& graph) {
  std::string bytes;
  append_count(bytes, graph.keyframes.size());
  for (const orbis::se3& T : graph.keyframes) {
    const auto m = T.to_matrix();
    for (int r = 0; r != 3; ++r)
      for (int c = 0; c != 4; ++c) append(bytes, static_cast<float>(m(r, c)));
  }
  append_count(bytes, graph.edges.size());
  for (const shown_edge& e : graph.edges) {
    append(bytes, e.a);
    append(bytes, e.b);
    append(bytes, static_cast<std::uint32_t>(e.kind));
  }
  append_count(bytes, graph.trail.size());
  for (const trail_point& p : graph.trail) {
    for (int i = 0; i != 3; ++i) append(bytes, p.position[i]);
    append(bytes, static_cast<std::uint32_t>(p.begins ? 1 : 0));
  }
  return bytes;
}

std::string voxel_header(const shown_voxels& voxels, std::size_t blocks) {
  std::string bytes;
  append(bytes, static_cast<float>(voxels.resolution));
  append(bytes, voxels.floor);
  append(bytes, voxels.ceiling);
  append(bytes, static_cast<std::uint32_t>(voxels.revision));
  append_count(bytes, blocks);
  return bytes;
}

std::string block_message(const block_index& index, const voxel_block& block) {
  std::string bytes;
  bytes.reserve(16 + 8 * block.voxels.size());
  for (const std::int32_t i : index) append(bytes, i);
  append_count(bytes, block.voxels.size());
  for (const shown_voxel& v : block.voxels)
    for (const std::uint8_t b : {v.x, v.y, v.z, v.level, v.color.r, v.color.g, v.color.b, std::uint8_t{0}})
      bytes.push_back(static_cast<char>(b));
  return bytes;
}

}  // namespace app
