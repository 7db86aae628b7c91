// SPDX-License-Identifier: BSD-3-Clause
//
// Shows the scene in a window with OpenGL 3.3. GLFW must be called from one thread; on Linux this may be any thread,
// here the viewer's thread.
#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#define GL_GLEXT_PROTOTYPES 1
#include <GL/gl.h>
#include <GL/glext.h>
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include "formatted_text.hpp"
#include "viewer/backend.hpp"
#include "viewer/orbit.hpp"
#include "viewer/viewer_page.hpp"

namespace app {
namespace {

using orbis::vec3;
using orbis::vec3f;

struct rgba {
  std::uint8_t r, g, b, a;
};
constexpr rgba camera_color{128, 255, 140, 255}, keyframe_color{110, 170, 255, 255}, trail_color{255, 196, 84, 255},
    grid_color{255, 255, 255, 26};
constexpr std::array<rgba, 3> edge_colors{rgba{130, 150, 190, 70}, {120, 180, 150, 150}, {255, 90, 160, 255}};

struct cube_instance {
  float x, y, z, edge;
  rgba color;
};
struct line_instance {
  float ax, ay, az, bx, by, bz;
  rgba color;
};

line_instance line(const vec3f& a, const vec3f& b, rgba color) {
  return {a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), color};
}

void add_frustum(std::vector<line_instance>& lines, const orbis::se3& T_world_camera, const frustum_rays& rays,
                 float depth, rgba color) {
  const auto T = T_world_camera.cast<float>();
  std::array<vec3f, 4> corner;
  for (std::size_t i = 0; i != 4; ++i) corner[i] = T * vec3f(rays[i] * depth);
  for (std::size_t i = 0; i != 4; ++i) {
    lines.push_back(line(T.translation(), corner[i], color));
    lines.push_back(line(corner[i], corner[(i + 1) % 4], color));
  }
  // A triangle marks the upper side.
  const vec3f roof = 0.5F * (corner[0] + corner[1]) - 0.25F * (corner[3] - corner[0]);
  lines.push_back(line(corner[0], roof, color));
  lines.push_back(line(roof, corner[1], color));
}

class gl_program {
 public:
  gl_program() = default;
  /// Creates the program. Returns false on an error, with the reason in `message`.
  [[nodiscard]] bool make(const char* vertex, const char* fragment, std::string& message) {
    program_ = glCreateProgram();
    for (const auto& [kind, body] : {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
      const GLuint shader = glCreateShader(static_cast<GLenum>(kind));
      const std::array<const char*, 2> text{"#version 330 core\n", body};
      glShaderSource(shader, 2, text.data(), nullptr);
      glCompileShader(shader);
      GLint good = 0;
      glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
      if (good == 0) {
        std::array<char, 512> log{};
        glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
        message = log.data();
        return false;
      }
      glAttachShader(program_, shader);
      glDeleteShader(shader);
    }
    glLinkProgram(program_);
    GLint good = 0;
    glGetProgramiv(program_, GL_LINK_STATUS, &good);
    if (good == 0) message = "the shaders cannot be linked";
    return good != 0;
  }
  void use() const { glUseProgram(program_); }
  [[nodiscard]] GLint at(const char* name) const { return glGetUniformLocation(program_, name); }

 private:
  GLuint program_ = 0;
};

/// A list of instances on the graphics card; each has attributes made of floats, and then a colour.
class instance_list {
 public:
  /// `sizes`: number of floats in each attribute before the colour.
  void make(std::initializer_list<int> sizes) {
    glGenVertexArrays(1, &array_);
    glGenBuffers(1, &buffer_);
    glBindVertexArray(array_);
    glBindBuffer(GL_ARRAY_BUFFER, buffer_);
    int floats = 0;
    for (const int n : sizes) floats += n;
    const auto stride = static_cast<GLsizei>(4 * floats + 4);
    GLuint index = 0;
    std::uintptr_t offset = 0;
    for (const int n : sizes) {
      glVertexAttribPointer(index, n, GL_FLOAT, GL_FALSE, stride, std::bit_cast<const void*>(offset));
      glEnableVertexAttribArray(index);
      glVertexAttribDivisor(index++, 1);
      offset += 4 * static_cast<std::uintptr_t>(n);
    }
    glVertexAttribPointer(index, 4, GL_UNSIGNED_BYTE, GL_TRUE, stride, std::bit_cast<const void*>(offset));
    glEnableVertexAttribArray(index);
    glVertexAttribDivisor(index, 1);
  }
  template <class Instance>
  void set(const std::vector<Instance>& all) {
    count_ = static_cast<GLsizei>(all.size());
    glBindBuffer(GL_ARRAY_BUFFER, buffer_);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(all.size() * sizeof(Instance)), all.data(), GL_DYNAMIC_DRAW);
  }
  void draw(GLsizei vertices) const {
    if (count_ == 0) return;
    glBindVertexArray(array_);
    glDrawArraysInstanced(GL_TRIANGLES, 0, vertices, count_);
  }

 private:
  GLuint array_ = 0, buffer_ = 0;
  GLsizei count_ = 0;
};

/// The last error message of GLFW, which reports errors only through a callback.
std::string& last_glfw_error() {
  static std::string text;
  return text;
}

class window_backend final : public viewer_backend {
 public:
  window_backend() = default;
  window_backend(const window_backend&) = delete;
  window_backend& operator=(const window_backend&) = delete;
  ~window_backend() override {
    if (has_gui_) {
      ImGui_ImplOpenGL3_Shutdown();
      ImGui_ImplGlfw_Shutdown();
      ImGui::DestroyContext();
    }
    if (window_ != nullptr) glfwDestroyWindow(window_);
    glfwTerminate();
  }

  [[nodiscard]] orbis::result<void> open();
  [[nodiscard]] bool draw(const viewer_scene& scene) override;
  [[nodiscard]] std::string where() const override { return {}; }
  [[nodiscard]] std::chrono::milliseconds interval() const override { return std::chrono::milliseconds{33}; }

 private:
  using clock = std::chrono::steady_clock;

  void upload(const viewer_scene& scene);
  void upload_camera(const viewer_scene& scene);
  void upload_voxels(const shown_voxels& voxels);
  void move_eye(const viewer_scene& scene);
  void draw_world(const viewer_scene& scene, int width, int height);
  void draw_panel(const viewer_scene& scene);
  void draw_image(const shown_frame& frame);

  GLFWwindow* window_ = nullptr;
  bool has_gui_ = false;
  gl_program voxel_program_, line_program_;
  instance_list cubes_, graph_, trail_, camera_, grid_;
  GLuint texture_ = 0;
  orbit eye_;
  clock::time_point last_draw_ = clock::now();

  // Objects on the graphics card.
  std::uint64_t voxel_revision_ = 0, graph_revision_ = 0, frame_ = ~std::uint64_t{0};

  float scale_ = 1.0F;  // scale of the panel; larger on high-resolution screens
  bool by_height_ = false, shows_voxels_ = true, shows_graph_ = true;
  float cut_ = 0.75F, top_cut_ = 1.0F;
};

orbis::result<void> window_backend::open() {
  const auto no_window = [](const std::string& why) {
    return orbis::fail(orbis::errc::unsupported, "--viewer window",
                       "no window can be opened: " + why + " (--viewer web uses a browser instead)");
  };
  glfwSetErrorCallback([](int, const char* text) { last_glfw_error() = text; });
  if (glfwInit() == 0) return no_window(last_glfw_error());
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_FOCUS_ON_SHOW, GLFW_FALSE);
  window_ = glfwCreateWindow(1280, 800, "rgbd_slam", nullptr, nullptr);
  if (window_ == nullptr) return no_window(last_glfw_error());
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(0);  // the viewer's thread controls the frame rate

  ImGui::CreateContext();
  has_gui_ = true;
  ImGui::GetIO().IniFilename = nullptr;  // prevents writing into the current folder
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  float scale_x = 1.0F, scale_y = 1.0F;
  glfwGetWindowContentScale(window_, &scale_x, &scale_y);
  scale_ = std::max(scale_x, 1.0F);
  ImGui::GetIO().FontGlobalScale = scale_;
  style.ScaleAllSizes(scale_);
  style.WindowRounding = 6.0F;
  style.FrameRounding = 3.0F;
  style.Colors[ImGuiCol_WindowBg] = {0.094F, 0.102F, 0.122F, 0.90F};
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");

  std::string message;
  if (!voxel_program_.make(voxel_vertex_shader, voxel_fragment_shader, message) ||
      !line_program_.make(line_vertex_shader, line_fragment_shader, message))
    return no_window(message);
  cubes_.make({4});
  for (instance_list* list : {&graph_, &trail_, &camera_, &grid_}) list->make({3, 3});
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return {};
}

// -- uploads to the graphics card

void window_backend::upload_voxels(const shown_voxels& voxels) {
  std::vector<cube_instance> cubes;
  cubes.reserve(voxels.count);
  const auto resolution = static_cast<float>(voxels.resolution);
  Eigen::Array2i low = Eigen::Array2i::Constant(1 << 30), high = -low;
  for (const auto& [index, block] : voxels.blocks) {
    if (block.voxels.empty()) continue;
    low = low.min(Eigen::Array2i{index[0], index[1]});
    high = high.max(Eigen::Array2i{index[0] + 1, index[1] + 1});
    const auto at = [&, &index = index](std::size_t axis, std::uint8_t inside, float edge) {  // needed by clang < 16
      return static_cast<float>(index[axis] * block_voxels + inside) * resolution + 0.5F * edge;
    };
    for (const shown_voxel& v : block.voxels) {
      const float edge = resolution * static_cast<float>(1U << v.level);
      cubes.push_back(
          {at(0, v.x, edge), at(1, v.y, edge), at(2, v.z, edge), edge, {v.color.r, v.color.g, v.color.b, 255}});
    }
  }
  cubes_.set(cubes);

  // A grid under the map with a line every metre, or at a larger spacing if there would be too many lines.
  std::vector<line_instance> lines;
  if (!cubes.empty()) {
    const Eigen::Array2f from = (low.cast<float>() * resolution * static_cast<float>(block_voxels)).floor() - 1.0F;
    const Eigen::Array2f to = (high.cast<float>() * resolution * static_cast<float>(block_voxels)).ceil() + 1.0F;
    const float step = std::max(1.0F, std::ceil((to - from).maxCoeff() / 100.0F)), z = voxels.floor;
    for (float x = from.x(); x <= to.x(); x += step)
      lines.push_back(line({x, from.y(), z}, {x, to.y(), z}, grid_color));
    for (float y = from.y(); y <= to.y(); y += step)
      lines.push_back(line({from.x(), y, z}, {to.x(), y, z}, grid_color));
  }
  grid_.set(lines);
}

void window_backend::upload_camera(const viewer_scene& scene) {
  std::vector<line_instance> lines;
  if (scene.frame && scene.frame->T_world_camera) {
    add_frustum(lines, *scene.frame->T_world_camera, scene.camera, 0.22F, camera_color);
    if (!scene.graph.trail.empty() && !scene.is_over)
      lines.push_back(line(scene.graph.trail.back().position, scene.frame->T_world_camera->translation().cast<float>(),
                           trail_color));
  }
  camera_.set(lines);
}

void window_backend::upload(const viewer_scene& scene) {
  if (voxel_revision_ != scene.voxels.revision) {
    voxel_revision_ = scene.voxels.revision;
    upload_voxels(scene.voxels);
  }
  const bool has_new_graph = std::exchange(graph_revision_, scene.graph.revision) != scene.graph.revision;
  if (has_new_graph) {
    const shown_graph& g = scene.graph;
    std::vector<line_instance> lines;
    for (const shown_edge& e : g.edges)
      lines.push_back(line(g.keyframes[e.a].translation().cast<float>(), g.keyframes[e.b].translation().cast<float>(),
                           edge_colors[static_cast<std::size_t>(e.kind)]));
    for (const orbis::se3& T : g.keyframes) add_frustum(lines, T, scene.camera, 0.06F, keyframe_color);
    graph_.set(lines);
    lines.clear();
    for (std::size_t i = 1; i < g.trail.size(); ++i)
      if (!g.trail[i].begins) lines.push_back(line(g.trail[i - 1].position, g.trail[i].position, trail_color));
    trail_.set(lines);
  }
  const bool has_new_frame = scene.frame && std::exchange(frame_, scene.frame->number) != scene.frame->number;
  if (has_new_frame) {
    const auto& image = *scene.frame->image;
    glBindTexture(GL_TEXTURE_2D, texture_);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, image.width(), image.height(), 0, GL_RGB, GL_UNSIGNED_BYTE, image.data());
  }
  if (has_new_frame || has_new_graph) upload_camera(scene);
}

// -- display and user input

void window_backend::move_eye(const viewer_scene& scene) {
  const ImGuiIO& io = ImGui::GetIO();
  if (!io.WantCaptureMouse) {
    const auto [dx, dy] = std::pair{static_cast<double>(io.MouseDelta.x), static_cast<double>(io.MouseDelta.y)};
    const bool moved = dx != 0.0 || dy != 0.0;
    if (moved && (io.MouseDown[1] || io.MouseDown[2] || (io.MouseDown[0] && (io.KeyShift || io.KeyCtrl))))
      eye_.pan(dx, dy, static_cast<double>(io.DisplaySize.y));
    else if (moved && io.MouseDown[0])
      eye_.turn(dx, dy);
    if (io.MouseWheel != 0.0F) eye_.zoom(std::exp(-0.15 * static_cast<double>(io.MouseWheel)));
  }
  const auto now = clock::now();
  const double seconds = std::chrono::duration<double>(now - std::exchange(last_draw_, now)).count();
  if (scene.frame && scene.frame->T_world_camera) eye_.follow(*scene.frame->T_world_camera, seconds);
}

void window_backend::draw_world(const viewer_scene& scene, int width, int height) {
  glViewport(0, 0, width, height);
  glClearColor(0.082F, 0.090F, 0.106F, 1.0F);
  glDepthMask(GL_TRUE);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const Eigen::Matrix4f clip = eye_.clip_from_world(static_cast<double>(width) / height);
  if (shows_voxels_) {
    const vec3f at = eye_.position().cast<float>(), forward = eye_.forward().cast<float>();
    const float low = scene.voxels.floor, high = std::max(scene.voxels.ceiling, low + 0.1F);
    voxel_program_.use();
    glUniformMatrix4fv(voxel_program_.at("clip_from_world"), 1, GL_FALSE, clip.data());
    glUniform3fv(voxel_program_.at("eye"), 1, at.data());
    glUniform3fv(voxel_program_.at("forward"), 1, forward.data());
    glUniform1f(voxel_program_.at("nearest"), cut_ * static_cast<float>(eye_.distance()));
    glUniform1f(voxel_program_.at("highest"), top_cut_ >= 1.0F ? 1e9F : low + top_cut_ * (high - low));
    glUniform2f(voxel_program_.at("heights"), low, high);
    glUniform1f(voxel_program_.at("by_height"), by_height_ ? 1.0F : 0.0F);
    cubes_.draw(18);
  }
  line_program_.use();
  glUniformMatrix4fv(line_program_.at("clip_from_world"), 1, GL_FALSE, clip.data());
  glUniform2f(line_program_.at("viewport"), static_cast<float>(width), static_cast<float>(height));
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  const auto lines = [&](const instance_list& list, float pixels, float opacity) {
    glUniform1f(line_program_.at("width"), pixels);
    glUniform1f(line_program_.at("opacity"), opacity);
    list.draw(6);
  };
  lines(grid_, 1.0F, 1.0F);
  for (const bool hidden : {false, true}) {
    if (hidden) glDisable(GL_DEPTH_TEST);  // lines behind voxels are drawn faintly
    const float opacity = hidden ? 0.3F : 1.0F;
    if (shows_graph_) lines(graph_, 1.3F, opacity);
    lines(trail_, 2.5F, opacity);
    lines(camera_, 2.5F, opacity);
  }
  glDepthMask(GL_TRUE);
}

void window_backend::draw_image(const shown_frame& frame) {
  const float width = ImGui::GetContentRegionAvail().x;
  const float scale = width / static_cast<float>(frame.image->width());
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Image(std::bit_cast<ImTextureID>(static_cast<std::uintptr_t>(texture_)),
               {width, scale * static_cast<float>(frame.image->height())});
  ImDrawList* const list = ImGui::GetWindowDrawList();
  for (const bool tracked : {false, true})  // tracked features on top
    for (const shown_feature& f : frame.features) {
      if (f.tracked != tracked) continue;
      const float x = at.x + scale * f.x, y = at.y + scale * f.y, r = tracked ? 2.0F : 1.2F;
      list->AddRect({x - r, y - r}, {x + r, y + r},
                    tracked ? IM_COL32(93, 255, 122, 255) : IM_COL32(255, 190, 70, 170));
    }
}

void window_backend::draw_panel(const viewer_scene& scene) {
  const shown_numbers& n = scene.numbers;
  ImGui::SetNextWindowPos({12.0F, 12.0F}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({340.0F * scale_, 0.0F}, ImGuiCond_Always);
  ImGui::Begin(scene.title.c_str(), nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoSavedSettings);
  const ImVec4 good{0.49F, 0.86F, 0.55F, 1.0F}, bad{1.0F, 0.48F, 0.42F, 1.0F}, dim{0.60F, 0.64F, 0.70F, 1.0F};
  if (scene.frame) {
    const auto& f = *scene.frame;
    draw_image(f);
    const auto tracked = std::count_if(f.features.begin(), f.features.end(), [](const auto& p) { return p.tracked; });
    ImGui::TextColored(scene.is_over      ? dim
                       : f.T_world_camera ? good
                                          : bad,
                       "%s", scene.is_over ? "finished" : f.state.c_str());
    ImGui::SameLine();
    ImGui::Text("%s", text("frame %zu of %zu", static_cast<std::size_t>(f.number) + 1, n.frames).c_str());
    ImGui::Text("%s", text("features %zu, tracked %td", f.features.size(), tracked).c_str());
  } else {
    ImGui::TextColored(dim, "waiting for the first frame");
  }
  ImGui::Separator();
  const auto row = [&](const char* what, const std::string& value) {
    ImGui::TextColored(dim, "%s", what);
    ImGui::SameLine(160.0F * scale_);
    ImGui::TextUnformatted(value.c_str());
  };
  row("tracking, p95", text("%.1f ms, %.1f ms", n.tracking_ms, n.tracking_p95_ms));
  row("keyframes", std::to_string(scene.graph.keyframes.size()));
  if (n.insertions != 0) {
    row("insertion, p95", text("%.1f ms, %.1f ms", n.insert_ms, n.insert_p95_ms));
    row("maximum lag", text("%zu frames", n.behind_frames));
    row("corrections, last", n.corrections == 0 ? "0" : text("%zu, %.1f ms", n.corrections, n.correction_ms));
  }
  row("voxels", std::to_string(scene.voxels.count));
  if (!scene.voxels.absent.empty()) {
    ImGui::PushTextWrapPos();
    ImGui::TextColored(dim, "%s", scene.voxels.absent.c_str());
    ImGui::PopTextWrapPos();
  }
  ImGui::Separator();
  ImGui::Checkbox("follow the camera", &eye_.follows);
  ImGui::Checkbox("colour by height", &by_height_);
  if (by_height_) {
    ImGui::SameLine();
    ImGui::TextColored(dim, "%s", text("%.1f m ... %.1f m", scene.voxels.floor, scene.voxels.ceiling).c_str());
  }
  ImGui::Checkbox("voxels", &shows_voxels_);
  ImGui::SameLine();
  ImGui::Checkbox("keyframes and graph", &shows_graph_);
  ImGui::SliderFloat("near cut", &cut_, 0.0F, 1.0F, "%.2f");
  ImGui::SliderFloat("height cut", &top_cut_, 0.0F, 1.0F, "%.2f");
  ImGui::End();
}

bool window_backend::draw(const viewer_scene& scene) {
  glfwPollEvents();
  if (glfwWindowShouldClose(window_) != 0) return false;
  if (glfwGetWindowAttrib(window_, GLFW_ICONIFIED) != 0) return true;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  upload(scene);
  move_eye(scene);
  draw_panel(scene);
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  if (width > 0 && height > 0) draw_world(scene, width, height);
  glDisable(GL_DEPTH_TEST);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
  return true;
}

}  // namespace

orbis::result<std::unique_ptr<viewer_backend>> open_window() {
  auto window = std::make_unique<window_backend>();
  if (auto opened = window->open(); !opened) return orbis::fail(opened.error());
  return window;
}

}  // namespace app
