// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment problems in the text format of "Bundle Adjustment in the Large": the numbers of
/// cameras, points and observations; for each observation its camera, its point and the pixel; nine
/// numbers for each camera; three for each point. Any blanks may stand between them.
///
/// A camera is an angle-axis rotation R, a translation t, a focal length f and two coefficients of radial
/// distortion k1, k2. It sees X at -f (1 + k1 r^2 + k2 r^4) d with p = R X + t, d = (p.x, p.y) / p.z and
/// r = |d|: it looks along its negative z axis, and pixels count from the middle of the image, y upwards.
///
/// Source: S. Agarwal, N. Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the large", ECCV 2010,
/// and https://grail.cs.washington.edu/projects/bal.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <iterator>
#include <limits>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io {

/// `point` seen by `camera`, both as indices.
struct bal_observation {
  std::uint32_t camera = 0;
  std::uint32_t point = 0;
  vec2 pixel = vec2::Zero();  ///< from the middle of the image, y upwards
};

struct bal_problem {
  std::vector<std::array<double, 9>> cameras;  ///< rotation (angle-axis, radians), translation, f, k1, k2
  std::vector<vec3> points;                    ///< in the world, in the file's unit of length
  std::vector<bal_observation> observations;   ///< in the file's order
};

/// Where a camera of the format sees a point; empty in the plane of its centre, and for what is not
/// finite. Points behind the camera have a pixel too, as everybody's residuals have it.
[[nodiscard]] inline std::optional<vec2> project_bal(std::span<const double, 9> camera, const vec3& point) {
  const vec3 p = so3::exp(vec3(camera[0], camera[1], camera[2])) * point + vec3(camera[3], camera[4], camera[5]);
  const vec2 d = p.head<2>() / p.z();
  const double r2 = d.squaredNorm();
  const vec2 pixel = -camera[6] * (1.0 + r2 * (camera[7] + r2 * camera[8])) * d;
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

namespace detail {

/// The file number by number, with the line for errors.
class bal_parser {
 public:
  bal_parser(std::string_view text, const std::filesystem::path& where)
      : where_{where}, at_{text.data()}, end_{text.data() + text.size()} {}

  [[nodiscard]] result<bal_problem> parse() {
    bal_problem problem;
    if (read_header(problem) && read_observations(problem) && read_parameters(problem) && ends()) return problem;
    return fail(code_, at_line(where_, line_), std::move(problem_));
  }

 private:
  bool reject(std::string why, errc code = errc::malformed) {
    problem_ = std::move(why);
    code_ = code;
    return false;
  }
  void skip_blanks() {
    for (; at_ != end_ && is_blank(*at_); ++at_) line_ += *at_ == '\n' ? 1 : 0;
  }
  [[nodiscard]] std::string quoted_field() const {
    std::string text{"\""};
    for (const char* c = at_; c != end_ && !is_blank(*c) && c - at_ != 40; ++c)
      text += *c >= ' ' && *c < '\x7f' ? *c : '?';
    return text + "\"";
  }

  /// The number that comes next; `what` it is, for the error. `of` numbers the thing it belongs to.
  template <class T>
  bool read(T& value, const char* what, std::size_t of) {
    skip_blanks();
    const auto named = [&] { return std::string{what} + " " + std::to_string(of); };
    if (at_ == end_) return reject("the file ends early: " + named() + " is not all there");
    const char* first = at_;
    if (*first == '+' && end_ - first > 1 && first[1] != '-') ++first;
    const auto [last, failure] = std::from_chars(first, end_, value);
    if (failure != std::errc{} || (last != end_ && !is_blank(*last)))
      return reject(named() + " has " + quoted_field() +
                    (std::is_integral_v<T> ? ", which is no index" : ", which is no number"));
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value)) return reject(named() + " has " + quoted_field() + ", which is not finite");
    at_ = last;
    return true;
  }

  bool read_header(bal_problem& problem) {
    const std::string_view text{at_, static_cast<std::size_t>(end_ - at_)};
    if (text.starts_with("BZh") || text.starts_with("\x1f\x8b"))
      return reject("is compressed and has to be unpacked first", errc::unsupported);
    if (text.starts_with("\xEF\xBB\xBF")) at_ += 3;
    std::uint64_t counts[3];
    for (std::uint64_t& count : counts) {
      skip_blanks();
      const auto [last, failure] = std::from_chars(at_, end_, count);
      if (failure != std::errc{} || (last != end_ && !is_blank(*last)))
        return reject("a file begins with the numbers of its cameras, points and observations" +
                      (at_ == end_ ? std::string{} : ", and " + quoted_field() + " is none"));
      at_ = last;
    }
    // A number takes a blank and a digit at least: what cannot follow is not allocated for.
    const auto fitting = static_cast<std::uint64_t>(end_ - at_) / 2;
    const auto [cameras, points, observations] = counts;
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    if (cameras > fitting / 9 || points > fitting / 3 || observations > fitting / 4 ||
        9 * cameras + 3 * points + 4 * observations > fitting || cameras > most || points > most)
      return reject("there are not as many numbers in the file as " + std::to_string(cameras) + " cameras, " +
                    std::to_string(points) + " points and " + std::to_string(observations) + " observations have");
    problem.cameras.resize(static_cast<std::size_t>(cameras));
    problem.points.resize(static_cast<std::size_t>(points), vec3::Zero());
    problem.observations.resize(static_cast<std::size_t>(observations));
    return true;
  }

  bool read_observations(bal_problem& problem) {
    for (std::size_t k = 0; k != problem.observations.size(); ++k) {
      bal_observation& o = problem.observations[k];
      if (!read(o.camera, "observation", k)) return false;
      if (o.camera >= problem.cameras.size())
        return reject("observation " + std::to_string(k) + " is of camera " + std::to_string(o.camera) +
                      ", which there is not");
      if (!read(o.point, "observation", k)) return false;
      if (o.point >= problem.points.size())
        return reject("observation " + std::to_string(k) + " is of point " + std::to_string(o.point) +
                      ", which there is not");
      if (!read(o.pixel.x(), "observation", k) || !read(o.pixel.y(), "observation", k)) return false;
    }
    return true;
  }

  bool read_parameters(bal_problem& problem) {
    for (std::size_t i = 0; i != problem.cameras.size(); ++i)
      for (double& value : problem.cameras[i])
        if (!read(value, "camera", i)) return false;
    for (std::size_t j = 0; j != problem.points.size(); ++j)
      for (int c = 0; c != 3; ++c)
        if (!read(problem.points[j][c], "point", j)) return false;
    return true;
  }

  bool ends() {
    skip_blanks();
    return at_ == end_ || reject("there is more in the file than belongs there: " + quoted_field());
  }

  const std::filesystem::path& where_;
  const char* at_;
  const char* end_;
  std::size_t line_ = 1;
  std::string problem_;
  errc code_ = errc::malformed;
};

}  // namespace detail

/// The problem in `text`; `where` names the source in errors. Linear in the length of the text, memory in
/// proportion to it whatever the first line says. Errors, with the line: malformed; unsupported
/// (compressed, as the files of the project's site are).
[[nodiscard]] inline result<bal_problem> parse_bal(std::string_view text, const std::filesystem::path& where = {}) {
  return detail::bal_parser{text, where}.parse();
}

/// Reads all of a stream; see `parse_bal`. Errors: unreadable, malformed, unsupported.
[[nodiscard]] inline result<bal_problem> read_bal(std::istream& in, const std::filesystem::path& where = {}) {
  const std::string text{std::istreambuf_iterator<char>{in}, std::istreambuf_iterator<char>{}};
  if (in.bad()) return fail(errc::unreadable, where.string(), "cannot be read");
  return parse_bal(text, where);
}

/// Reads a BAL file; see `parse_bal`. Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] inline result<bal_problem> read_bal(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_bal(*text, path);
}

/// The problem as text, with as many digits as it takes to read the same numbers back.
/// @pre the observations' indices are in range
[[nodiscard]] inline std::string format_bal(const bal_problem& problem) {
  std::string text;
  text.reserve(48 * problem.observations.size() + 24 * (9 * problem.cameras.size() + 3 * problem.points.size()) + 64);
  const auto add = [&](auto value, char after) {
    char buffer[32];
    const auto [end, failure] = std::to_chars(buffer, buffer + sizeof buffer, value);
    if (failure == std::errc{}) text.append(buffer, end);
    text += after;
  };
  add(problem.cameras.size(), ' ');
  add(problem.points.size(), ' ');
  add(problem.observations.size(), '\n');
  for (const bal_observation& o : problem.observations) {
    add(o.camera, ' ');
    add(o.point, ' ');
    add(o.pixel.x(), ' ');
    add(o.pixel.y(), '\n');
  }
  for (const auto& camera : problem.cameras)
    for (const double value : camera) add(value, '\n');
  for (const vec3& point : problem.points)
    for (int c = 0; c != 3; ++c) add(point[c], '\n');
  return text;
}

/// Writes a BAL file, whole or not at all. Errors: write_failed.
inline result<void> write_bal(const std::filesystem::path& path, const bal_problem& problem) {
  const std::string text = format_bal(problem);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

}  // namespace orbis::io
