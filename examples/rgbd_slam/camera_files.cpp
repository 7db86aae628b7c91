// SPDX-License-Identifier: BSD-3-Clause
#include "camera_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <iterator>
#include <locale>
#include <sstream>
#include <vector>

#include <opencv2/core.hpp>

#include <orbis/camera/plausible.hpp>
#include <orbis/camera/presets.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/io/camera_file.hpp>

#include "settings.hpp"

namespace app {
namespace {

using orbis::errc;
using orbis::fail;
using orbis::result;

constexpr std::size_t most_bytes = 65536;  // camera files are far smaller

/// Returns true if brackets are nested so deeply that the recursive parser might overflow the stack.
bool is_nested_deeply(const std::string& text) {
  int depth = 0;
  return std::any_of(text.begin(), text.end(), [&](char c) {
    depth += (c == '[' || c == '{') - (c == ']' || c == '}');
    return depth > 20;
  });
}

/// Converts YAML to OpenCV's dialect: a special first line, indented lists, one document.
std::string to_opencv_yaml(const std::string& text) {
  std::istringstream in{text};
  std::string all = "%YAML:1.0\n---\n";
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("%") || line.starts_with("---") || line.starts_with("...")) continue;
    all += (line.starts_with("-") ? "  " : "") + line + "\n";
  }
  return all;
}

/// The values in a JSON or YAML file, each of which may have one of several names.
class named_values {
 public:
  named_values(cv::FileNode root) : tables_{root} {
    for (const char* const inner : {"camera", "intrinsics", "intrinsic", "color"})
      if (root[inner].isMap()) tables_.push_back(root[inner]);
  }
  [[nodiscard]] cv::FileNode find(std::initializer_list<const char*> names) const {
    for (const cv::FileNode& table : tables_)
      for (const char* const name : names)
        if (cv::FileNode node = table[name]; !node.empty()) return node;
    return {};
  }
  [[nodiscard]] std::optional<double> number(std::initializer_list<const char*> names) const {
    const cv::FileNode node = find(names);
    if (!node.isReal() && !node.isInt()) return std::nullopt;
    return static_cast<double>(node);
  }
  /// The numbers in a list, which may be nested or the `data` of a matrix; empty if there is no list.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> names) const {
    cv::FileNode node = find(names);
    if (node.isMap()) node = node["data"];
    std::vector<double> all;
    append(node, all);
    return all;
  }
  [[nodiscard]] std::string text(std::initializer_list<const char*> names) const {
    const cv::FileNode node = find(names);
    return node.isString() ? static_cast<std::string>(node) : std::string{};
  }

 private:
  static void append(const cv::FileNode& node, std::vector<double>& all) {
    if (node.isReal() || node.isInt()) all.push_back(static_cast<double>(node));
    if (node.isSeq())
      for (const cv::FileNode& part : node) append(part, all);
  }
  std::vector<cv::FileNode> tables_;
};

/// Focal lengths and principal point in pixels.
using focal_and_center = std::array<double, 4>;

/// The focal lengths and principal point in a 3x3 camera matrix, stored row by row, or column by column as in Open3D
/// and MATLAB; empty if it is not a camera matrix.
std::optional<focal_and_center> of_matrix(const std::array<double, 9>& m) {
  const auto vanishes = [&](std::size_t i) { return std::abs(m[i]) <= 1e-3 * std::abs(m[0]); };
  if (m[8] != 1.0 || !vanishes(1) || !vanishes(3)) return std::nullopt;
  if (vanishes(6) && vanishes(7)) return focal_and_center{m[0], m[4], m[2], m[5]};
  if (vanishes(2) && vanishes(5)) return focal_and_center{m[0], m[4], m[6], m[7]};
  return std::nullopt;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

result<orbis::camera::any_camera> make_model(const orbis::camera::intrinsics& k, const std::string& name,
                                             std::vector<double> d, const std::string& where) {
  if (std::all_of(d.begin(), d.end(), [](double v) { return v == 0.0; }))
    return orbis::camera::any_camera{orbis::camera::pinhole{k}};
  if (!std::all_of(d.begin(), d.end(), [](double v) { return std::isfinite(v); }))
    return fail(errc::malformed, where, "the distortion is not finite");
  std::string model = lower_case(name);
  if (model.starts_with("distortion.")) model.erase(0, 11);  // librealsense
  const auto is_one_of = [&](std::initializer_list<const char*> names) {
    return std::find(names.begin(), names.end(), model) != names.end();
  };
  const bool is_fisheye =
      is_one_of({"equidistant", "fisheye", "opencv_fisheye", "kannala_brandt", "kannalabrandt8", "kannala_brandt4"});
  const bool is_radtan = is_one_of({"", "plumb_bob", "rational_polynomial", "radtan", "radial-tangential",
                                    "brown_conrady", "brown conrady", "pinhole", "perspective", "opencv"});
  if (is_fisheye && d.size() == 4)
    return orbis::camera::any_camera{orbis::camera::kannala_brandt{k, {d[0], d[1], d[2], d[3]}}};
  if (is_radtan && d.size() >= 4 && d.size() <= 8) {
    d.resize(8);
    return orbis::camera::any_camera{
        orbis::camera::radial_tangential{k, {d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7]}}};
  }
  return fail(errc::unsupported, where,
              "distortion model " + orbis::in_quotes(name) + " with " + std::to_string(d.size()) +
                  " numbers is not supported: write a camera.toml");
}

result<camera_file> parse_camera(const named_values& values, const std::filesystem::path& path) {
  const std::string where = path.string();
  camera_file file;
  file.path = path;
  const auto width = values.number({"width", "image_width", "w", "Camera.width"}).value_or(0.0),
             height = values.number({"height", "image_height", "h", "Camera.height"}).value_or(0.0);
  const auto is_size = [](double v) { return v >= 0.0 && v <= 1e5 && v == std::floor(v); };
  if (!is_size(width) || !is_size(height) || (width == 0.0) != (height == 0.0))
    return fail(errc::malformed, where, "width and height must be whole numbers up to 100000");
  focal_and_center f{};
  auto matrix = values.numbers({"intrinsic_matrix", "camera_matrix", "K", "k"});
  if (matrix.size() == 9) {
    std::array<double, 9> m{};
    std::copy(matrix.begin(), matrix.end(), m.begin());
    const auto found = of_matrix(m);
    if (!found) return fail(errc::malformed, where, "the camera matrix is not fx 0 cx, 0 fy cy, 0 0 1");
    f = *found;
  } else {
    const std::array<std::optional<double>, 4> named{values.number({"fx", "fl_x", "Camera.fx", "Camera1.fx"}),
                                                     values.number({"fy", "fl_y", "Camera.fy", "Camera1.fy"}),
                                                     values.number({"cx", "ppx", "Camera.cx", "Camera1.cx"}),
                                                     values.number({"cy", "ppy", "Camera.cy", "Camera1.cy"})};
    for (std::size_t i = 0; i != f.size(); ++i) {
      if (!named[i])
        return fail(errc::malformed, where,
                    "has no camera: neither intrinsic_matrix, camera_matrix or K, nor fx, fy, cx (ppx) and cy (ppy)");
      f[i] = *named[i];
    }
  }
  const auto k =
      orbis::camera::plausible({static_cast<int>(width), static_cast<int>(height), f[0], f[1], f[2], f[3]}, where);
  if (!k) return fail(k.error());
  auto d = values.numbers({"distortion_coefficients", "D", "d", "coeffs", "distortion"});
  for (const char* const prefix : {"Camera.", "Camera1."}) {
    std::vector<double> orb;
    for (const char* const name : {"k1", "k2", "p1", "p2", "k3"})
      orb.push_back(values.number({(prefix + std::string{name}).c_str()}).value_or(0.0));
    if (d.empty() && values.number({(prefix + std::string{"k1"}).c_str()})) d = orb;
  }
  auto model = make_model(*k, values.text({"distortion_model", "model", "Camera.type"}), d, where);
  if (!model) return fail(model.error());
  file.camera.model = *model;
  if (const auto scale =
          values.number({"depth_scale", "DepthMapFactor", "RGBD.DepthMapFactor", "png_depth_scale", "scale"})) {
    if (!(*scale > 0.0 && *scale < 1e9)) return fail(errc::malformed, where, "the depth scale must be above zero");
    file.camera.depth_scale = *scale < 1.0 ? 1.0 / *scale : *scale;
    file.has_depth_scale = true;
  }
  if (const auto fps = values.number({"fps", "Camera.fps"}); fps && *fps > 0.0 && *fps < 1e9) file.camera.fps = *fps;
  return file;
}

/// Reads a 3x3 camera matrix, the upper left part of a 4x4 matrix, or fx, fy, cx, cy. For a file with fx, fy, cx, cy,
/// the depth scale is 5000 if the folder contains associated.txt, which indicates the ETH3D layout.
result<camera_file> read_matrix(const std::string& text, const std::filesystem::path& path) {
  std::istringstream in{text};
  in.imbue(std::locale::classic());
  const std::vector<double> v{std::istream_iterator<double>{in}, {}};
  std::optional<focal_and_center> f;
  if (in.eof() && v.size() == 4) f = focal_and_center{v[0], v[1], v[2], v[3]};
  if (in.eof() && (v.size() == 9 || v.size() == 16)) {
    const std::size_t row = v.size() == 9 ? 3 : 4;
    std::array<double, 9> m{};
    for (std::size_t i = 0; i != 9; ++i) m[i] = v[i / 3 * row + i % 3];
    f = of_matrix(m);
  }
  if (!f)
    return fail(errc::malformed, path.string(), "is neither a camera matrix, fx 0 cx 0 fy cy 0 0 1, nor fx fy cx cy");
  const auto& [fx, fy, cx, cy] = *f;
  const auto k = orbis::camera::plausible({0, 0, fx, fy, cx, cy}, path.string());
  if (!k) return fail(k.error());
  camera_file file;
  file.path = path;
  file.camera.model = orbis::camera::pinhole{*k};
  std::error_code ignored;
  if (v.size() == 4 && std::filesystem::exists(path.parent_path() / "associated.txt", ignored))
    file.camera.depth_scale = 5000.0;
  return file;
}

}  // namespace

std::string camera_file::describe() const {
  const orbis::camera::intrinsics& k = camera.model.k();
  char text[200];
  std::snprintf(text, sizeof text, ": %d x %d, fx %.6g, fy %.6g, cx %.6g, cy %.6g, depth_scale %.6g%s", k.width,
                k.height, k.fx, k.fy, k.cx, k.cy, camera.depth_scale,
                has_depth_scale                ? ""
                : camera.depth_scale == 1000.0 ? " (millimetres are assumed)"
                                               : " (the depth scale of ETH3D is assumed)");
  return "the camera is read from " + path.filename().string() + ", " + std::string{camera.model.model_name()} + text;
}

result<camera_file> read_camera_file(const std::filesystem::path& path) {
  auto text = orbis::read_file(path, most_bytes);
  if (!text) return fail(text.error());
  if (path.extension() == ".txt") return read_matrix(*text, path);
  const bool is_json = text->find_first_not_of(" \t\r\n\xEF\xBB\xBF") != std::string::npos &&
                       (*text)[text->find_first_not_of(" \t\r\n\xEF\xBB\xBF")] == '{';
  if (!is_json) *text = to_opencv_yaml(*text);
  if (is_nested_deeply(*text)) return fail(errc::malformed, path.string(), "is nested too deeply for a camera file");
  try {
    const cv::FileStorage storage{*text, cv::FileStorage::READ | cv::FileStorage::MEMORY};
    const cv::FileNode root = storage.root();
    if (!root.isMap()) return fail(errc::malformed, path.string(), "is neither JSON nor YAML with named values");
    return parse_camera(named_values{root}, path);
  } catch (const cv::Exception& e) {
    return fail(errc::malformed, path.string(), "is not valid JSON or YAML: " + orbis::shortened(e.err));
  }
}

result<orbis::camera::camera_settings> named_camera(const std::string& name) {
  if (!is_file_name(name)) return orbis::camera::preset(name);
  const std::filesystem::path path = name;
  if (path.extension() != ".json" && path.extension() != ".yaml" && path.extension() != ".yml")
    return orbis::io::read_camera(path);
  auto file = read_camera_file(path);
  if (!file) return fail(file.error());
  if (file->camera.model.width() == 0) return fail(errc::malformed, name, "width and height are missing");
  return file->camera;
}

std::filesystem::path find_camera_file(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const char* const name :
       {"camera_intrinsic.json", "intrinsic.json", "intrinsics.json", "camera.json", "camera_info.json",
        "cam_params.json", "camera.yaml", "camera.yml", "camera_info.yaml", "calibration.yaml", "calibration.yml",
        "cam_K.txt", "calibration.txt", "intrinsics.txt", "intrinsic.txt"})
    if (std::filesystem::is_regular_file(folder / name, ignored)) return folder / name;
  std::filesystem::path first;  // RTAB-Map exports one file per image
  for (std::filesystem::directory_iterator it{folder / "calib", ignored}, end; !ignored && it != end;
       it.increment(ignored))
    if (it->path().extension() == ".yaml" && (first.empty() || it->path() < first)) first = it->path();
  return first;
}

}  // namespace app
