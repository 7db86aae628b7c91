// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/io/trajectory_file.hpp>
#include <orbis/io/trajectory_reading.hpp>

#include "support/catch.hpp"
#include "support/random_motion.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using io::trajectory_layout;
using orbis::se3;
using orbis::stamped_pose;
using orbis::trajectory;

namespace {

constexpr double epoch = 1403715529.0;

trajectory some_path(std::size_t n, std::uint64_t seed, double interval = 0.05) {
  orbis::random_bits random{seed};
  trajectory poses;
  for (std::size_t i = 0; i != n; ++i)
    poses.push_back({epoch + interval * static_cast<double>(i), orbis::test::random_motion(random, 2.0, 1.0)});
  return poses;
}

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// A form of trajectory files.
struct form {
  trajectory_layout layout = trajectory_layout::tum;
  std::string separator = " ";
  int stamp_digits = 10;  // 13, 16, 19: ms, us, ns, as integers
  std::string more{};     // columns
};

std::string line_of(const stamped_pose& p, const form& f) {
  const auto& T = p.T_world_camera;
  const auto t = T.translation();
  const auto& s = f.separator;
  const auto number = [](double v) { return formatted("%.9g", v); };
  if (f.layout == trajectory_layout::kitti) {
    std::string line;
    const auto R = T.rotation_matrix();
    for (int row = 0; row != 3; ++row)
      for (int column = 0; column != 4; ++column)
        line += (line.empty() ? "" : s) + number(column == 3 ? t[row] : R(row, column));
    return line + "\n";
  }
  const auto& q = T.rotation().unit_quaternion();
  std::string line = f.stamp_digits == 10
                         ? formatted("%.6f", p.timestamp)
                         : formatted("%lld", std::llround(p.timestamp * std::pow(10.0, f.stamp_digits - 10)));
  for (const double v : {t.x(), t.y(), t.z()}) line += s + number(v);
  const bool w_first = f.layout == trajectory_layout::euroc;
  if (w_first) line += s + number(q.w());
  for (const double v : {q.x(), q.y(), q.z()}) line += s + number(v);
  return line + (w_first ? "" : s + number(q.w())) + f.more + "\n";
}

std::string text_of(const trajectory& poses, const form& f = {}) {
  std::string text;
  for (const stamped_pose& p : poses) text += line_of(p, f);
  return text;
}

bool same_poses(const trajectory& a, const trajectory& b, double time = 1e-6) {
  return std::ranges::equal(a, b, [&](const stamped_pose& x, const stamped_pose& y) {
    const se3 between = x.T_world_camera.inverse() * y.T_world_camera;
    return std::abs(x.timestamp - y.timestamp) <= time && between.log().norm() < 1e-7;
  });
}

bool has_note(const io::trajectory_reading& read, const std::string& part) {
  return std::ranges::any_of(read.notes, [&](const std::string& note) { return note.find(part) != note.npos; });
}

const std::string euroc_names =
    "timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []";

}  // namespace

TEST_CASE("layouts, separators, headers and units of trajectories are recognised") {
  using enum trajectory_layout;
  struct kind {
    std::string head;
    form of;
    std::vector<std::string> notes{};  // parts, in order
  };
  const std::string w = "read in EuRoC's layout: the quaternion has w first";
  const std::vector<kind> kinds{
      {"", {tum, " "}},
      {"# timestamp tx ty tz qx qy qz qw\n", {tum, "\t"}},
      {"# written by: timestamp tx ty tz qx qy qz qw\n", {tum, " "}},
      {"\xEF\xBB\xBF# BOM\n", {tum, ","}},
      {"time,tx,ty,tz,qx,qy,qz,qw\r\n", {tum, ", "}},
      {"timestamp tx ty tz qx qy qz qw\n", {tum, "; "}},
      {"#timestamp,tx,ty,tz,qx,qy,qz,qw\n", {tum, ",", 19}, {"the time stamps are in nanoseconds"}},
      {"", {tum, ";", 19}, {"the time stamps are in nanoseconds"}},
      {"", {tum, " ", 13}, {"the time stamps are in milliseconds"}},
      {"\n\n", {tum, " ", 16}, {"the time stamps are in microseconds"}},
      {"# any\n", {tum, " ", 19}, {"the time stamps are in nanoseconds"}},
      {"#" + euroc_names + "\n", {euroc, ",", 19}, {w, "the time stamps are in nanoseconds"}},
      {euroc_names + "\n", {euroc, ", ", 19, ",0.1,-2,3"}, {w, "the time stamps are in nanoseconds"}},
      {"", {euroc, ",", 19}, {w, "the time stamps are in nanoseconds"}},
      {"# timestamp tx ty tz qw qx qy qz\n", {euroc, " "}, {w}},
      {"#time, tx, ty, tz, q_w, q_x, q_y, q_z\n", {euroc, ", "}, {w}},
      {"", {kitti, " "}, {"read in KITTI's layout: one pose matrix per line"}},
      {"# poses\n", {kitti, "\t"}, {"read in KITTI's layout"}}};
  const trajectory poses = some_path(20, 1);
  for (const kind& k : kinds) {
    INFO(k.head << line_of(poses[0], k.of));
    const auto read = io::parse_trajectory_file(k.head + text_of(poses, k.of), "file.txt").value();
    CHECK(read.layout == k.of.layout);
    trajectory wanted = poses;
    for (std::size_t i = 0; k.of.layout == kitti && i != wanted.size(); ++i)
      wanted[i].timestamp = static_cast<double>(i);
    CHECK(same_poses(read.poses, wanted));
    REQUIRE(read.notes.size() == k.notes.size());
    for (std::size_t i = 0; i != k.notes.size(); ++i) CHECK(read.notes[i].find("file.txt: " + k.notes[i]) == 0);
  }
}

TEST_CASE("columns of trajectories are found by their names") {
  using enum trajectory_layout;
  const std::string w = "read in EuRoC's layout", ns = "the time stamps are in nanoseconds", blank = " ", comma = ",";
  struct kind {
    std::string head, separator;
    bool w_first;
    int stamp_digits = 10;
    std::vector<std::string> notes{};  // parts, in order
    std::string before{}, after_time{};
  };
  const std::string at_2 =
      "according to the header, column 2 is the time, column 3 the start of the position, and column 6";
  const std::string at_1 =
      "according to the header, column 1 is the time, column 3 the start of the position, and column 6";
  const std::vector<kind> kinds{
      {"timestamp,x,y,z,orientation_w,orientation_x,orientation_y,orientation_z", comma, true, 10, {w}},
      {"time,x,y,z,orientation.x,orientation.y,orientation.z,orientation.w", comma, false, 19, {ns}},
      {"%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
       "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
       comma,
       false,
       19,
       {ns}},
      {R"("timestamp","tx","ty","tz","qw","qx","qy","qz")", comma, true, 10, {w}},
      {R"("timestamp [ns]";"tx";"ty";"tz";"QX";"QY";"QZ";"QW")", "; ", false, 19, {ns}},
      {"t x y z w x y z", blank, true, 10, {w}},
      {"t,x,y,z,x,y,z,w", comma, false, 19, {ns}},
      {"# timestamp tx ty tz qw qx qy qz (seconds, metres)", blank, true, 10, {w}},
      {"# timestamps in seconds, then tx ty tz qw qx qy qz", blank, true, 10, {w}},
      {"# frame id, written by a: timestamp, tx, ty, tz, qw, qx, qy, qz", comma, true, 10, {w}},
      {"timestamp,frame,x,y,z,qw,qx,qy,qz", comma, true, 10, {w, at_1}, "", "7,"},
      {"timestamp,frame,x,y,z,qx,qy,qz,qw", comma, false, 10, {at_1}, "", "map,"},
      {"# timestamp frame tx ty tz qw qx qy qz", blank, true, 10, {w, at_1}, "", "7 "},
      {"#frame timestamp tx ty tz qw qx qy qz", blank, true, 10, {w, at_2}, "7 "},
      {",timestamp,tx,ty,tz,qw,qx,qy,qz", comma, true, 10, {w, at_2}, "7,"},
      {",timestamp,tx,ty,tz,qx,qy,qz,qw", comma, false, 19, {ns, at_2}, "7,"},
      {"0,1,2,3,4,5,6,7", comma, false, 10, {"line 1 does not list a quaternion"}},
      {"time,east,north,up,a,b,c,d",
       comma,
       false,
       10,
       {"line 1 does not list a quaternion (such as qx, qy, qz and qw): read as timestamp tx ty tz qx qy qz qw"}},
      {"time,east,north,up,a,b,c,d",
       comma,
       true,
       19,
       {w, ns, "line 1 does not list a quaternion (such as qx, qy, qz and qw): read as timestamp tx ty tz qw qx"}}};
  const trajectory poses = some_path(20, 1);
  for (const kind& k : kinds) {
    INFO(k.head);
    std::string text = k.head + "\n";
    for (const stamped_pose& p : poses) {
      std::string line = line_of(p, {k.w_first ? euroc : tum, k.separator, k.stamp_digits});
      text += k.before + line.insert(line.find(k.separator) + k.separator.size(), k.after_time);
    }
    const auto read = io::parse_trajectory_file(text, "file.txt");
    REQUIRE((read ? std::string{} : read.error().to_string()) == "");
    CHECK(same_poses(read->poses, poses));
    REQUIRE(read->notes.size() == k.notes.size());
    for (std::size_t i = 0; i != k.notes.size(); ++i) CHECK(read->notes[i].find("file.txt: " + k.notes[i]) == 0);
  }
}

TEST_CASE("the unit of a file is that of its first time, and of whole numbers that of its header") {
  const auto times = [](const std::string& text) {
    std::vector<double> all;
    for (const stamped_pose& p : io::parse_trajectory_file(text).value().poses) all.push_back(p.timestamp);
    return all;
  };
  const std::string pose = " 1 2 3 0 0 0 1\n", csv = ",1,2,3,1,0,0,0\n";
  CHECK(times("999999999999" + pose + "1000000000001" + pose) == std::vector<double>{999999999999.0, 1000000000001.0});
  CHECK(times("nan" + pose + "1403715529000" + pose) == std::vector<double>{1403715529.0});
  CHECK(times("#t [ns],x,y,z,qw,qx,qy,qz\n500000000" + csv + "1500000000" + csv) == std::vector<double>{0.5, 1.5});
  CHECK(times("#t [ns],x,y,z,qw,qx,qy,qz\n1403715529.5" + csv) == std::vector<double>{1403715529.5});
  CHECK(times("1.5" + pose + "1e1" + pose) == std::vector<double>{1.5, 10.0});
}

TEST_CASE("headers that name another order, and lines that are no poses, are errors") {
  const auto message = [](const std::string& text) {
    const auto read = io::parse_trajectory_file(text, "f.txt");
    return read ? std::string{} : read.error().to_string();
  };
  const std::string other = "f.txt:1: the columns are not time, position and quaternion";
  CHECK(message("# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ\n1, 1, 0, 0, 0, 1, 2, 3\n").find(other) == 0);
  CHECK(message("time qx qy qz qw tx ty tz\n1 0 0 0 1 1 2 3\n").find(other) == 0);
  CHECK(message("#t,x,y,z,qz,qy,qx,qw\n1,0,0,0,0,0,0,1\n").find(other) == 0);
  const std::string unnamed = "f.txt:1: the header does not name the columns of the time and the position";
  CHECK(message("seq,sec,nsec,x,y,z,qx,qy,qz,qw\n1,2,3,1,2,3,0,0,0,1\n") == unnamed);
  CHECK(message("time,vx,vy,vz,ax,ay,az,qx,qy,qz,qw\n1,1,2,3,1,2,3,0,0,0,1\n") == unnamed);
  CHECK(message("time,frame,x,y,z,qx,qy,qz,qw\n1,7,1,2,3,0,0,0\n").find("f.txt:2: a pose must have ") == 0);
  CHECK(message("1 2 3 4 0 0 0 1 9\n").find("f.txt:1: a pose must have 8 numbers") == 0);
  CHECK(message("1 2 3 4 0 0 0 1\n1.5,,3,4,0,0,0,1\n").find("f.txt:2: a pose must have 8 numbers") == 0);
  CHECK(message("1 2 3 4 0 0 0 1\n2 2 3 4 0 0 0 1e-9\n").find("f.txt:2: the quaternion is zero or too") == 0);
  CHECK(message("names\nmore names\n1 2 3 4 0 0 0 1\n") == "f.txt:2: \"more\" is not a number");
  CHECK(message("1 2 3 4 0 0 0 1\nnames\n").find("f.txt:2: ") == 0);
  CHECK(message("1,5 2,5 3 4 0 0 0 1\n").find("is not a number") != std::string::npos);
  CHECK(message("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 1 0 1 0 2 0 0 1\n").find("f.txt:2: ") == 0);
  CHECK(message("1 0 0 1 0 1 0 2 0 0 5 3\n").find("f.txt:1: the matrix is not a rigid transform") == 0);
  CHECK(message("").empty());
}

TEST_CASE("repeated times and runs: harmless, left out, or refused") {
  const trajectory first = some_path(50, 1), other = some_path(50, 2);
  trajectory later = other, between = other, earlier = other, whole = first, coarse = first, tenths = first,
             one_of_four, three_of_four;
  for (std::size_t i = 0; i != 50; ++i) {
    later[i].timestamp += 100.0;
    earlier[i].timestamp -= 100.0;
    between[i].timestamp += 0.02;
    whole[i].timestamp = std::floor(whole[i].timestamp);
    coarse[i].timestamp = 1.40372e9 + 0.5;
    tenths[i].timestamp = std::round(10.0 * tenths[i].timestamp) / 10.0;
  }
  for (std::size_t i = 0; i != 48; ++i) {
    one_of_four.push_back(first[i]);
    if (i % 4 == 3)
      one_of_four[i].timestamp = first[i - 1].timestamp;
    else
      three_of_four.push_back(first[i]);
  }
  const auto interleaved = [](const std::vector<trajectory>& runs) {
    std::string text;
    for (std::size_t i = 0; i != runs[0].size(); ++i)
      for (const trajectory& run : runs) text += line_of(run[i], {});
    return text;
  };
  const auto appended = [](trajectory a, const trajectory& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  const std::string a = text_of(first), b = text_of(other);
  // Keyframes of two runs that begin with the same pose, and a run that is continued after its last 20 poses.
  trajectory some_keyframes, other_keyframes{first[0]};
  for (std::size_t i = 0; i != 50; ++i)
    (i % 2 == 0 ? some_keyframes : other_keyframes).push_back((i % 2 == 0 ? first : other)[i]);
  const trajectory last_20(first.end() - 20, first.end());
  trajectory swapped = first;
  std::swap(swapped[10], swapped[11]);
  struct kind {
    std::string text;
    trajectory wanted;               // none: refused
    std::vector<std::string> notes;  // parts; for an error, of its message
  };
  const std::vector<kind> kinds{
      {a, first, {}},
      {interleaved({first, first}), first, {"50 repeated lines are left out"}},
      {interleaved({first, first, first}), first, {"100 repeated lines are left out"}},
      {a + a, first, {"time runs backwards at line 51; two runs in one file?", "50 repeated lines are left out"}},
      {a + b, first, {"time runs backwards at line 51; two runs in one file? The 50 poses from there on are left out"}},
      {a + text_of(between),
       first,
       {"backwards at line 51; two runs in one file? The 50 poses from there on are left"}},
      {a + text_of(later), appended(first, later), {}},
      {text_of(some_keyframes) + text_of(other_keyframes),
       some_keyframes,
       {"backwards at line 26; two runs in one file? The 26 poses from there on are left"}},
      {a + text_of(last_20) + text_of(later),
       appended(first, later),
       {"time runs backwards at line 51; two runs in one file?", "20 repeated lines are left out"}},
      {a + text_of(earlier), appended(earlier, first), {"time runs backwards at line 51; two runs in one file?"}},
      {interleaved({first, other}), {}, {"50 of 100 poses", "several runs in one file, or time stamps with too few"}},
      {text_of(tenths), {}, {"24 of 50 poses", "the time stamps are written with too few digits"}},
      {a + line_of(other[49], {}),
       first,
       {"1 poses with the time stamp of another pose are left out: several runs in one file, or time stamps with too"}},
      {text_of(one_of_four), {}, {"12 of 48 poses", "too few digits"}},
      {text_of(one_of_four) + text_of(between), {}, {"12 of 48 poses", "too few digits"}},
      {text_of(appended(one_of_four, later)), appended(three_of_four, later), {"12 poses with the time stamp"}},
      {text_of(swapped), first, {"not in chronological order; sorted"}},
      {interleaved({first, other, some_path(50, 3)}), {}, {"100 of 150 poses", "too few digits"}},
      {a + b + text_of(some_path(50, 3)), {}, {"100 of 150 poses", "backwards at line 51; 3 runs in one file?"}},
      {text_of(whole),
       {},
       {"47 of 50 poses have the time stamp of another pose: the time stamps are in whole seconds"}},
      {text_of(coarse), {}, {"49 of 50 poses", "the time stamps are written with too few digits"}}};
  for (const kind& k : kinds) {
    const auto read = io::parse_trajectory_file(k.text, "f.txt");
    if (k.wanted.empty()) {
      REQUIRE_FALSE(read);
      CHECK(read.error().code == orbis::errc::degenerate);
      for (const std::string& part : k.notes) CHECK(read.error().to_string().find(part) != std::string::npos);
      continue;
    }
    REQUIRE(read);
    INFO((read->notes.empty() ? "no note" : read->notes[0]));
    CHECK(same_poses(read->poses, k.wanted));
    REQUIRE(read->notes.size() == k.notes.size());
    for (std::size_t i = 0; i != k.notes.size(); ++i) CHECK(read->notes[i].find(k.notes[i]) != std::string::npos);
  }
}

TEST_CASE("trajectories of random forms are read with all of their poses") {
  using enum trajectory_layout;
  for (std::uint64_t seed = 0; seed != 150; ++seed) {
    orbis::random_bits random{seed};
    const auto chance = [&](std::uint32_t in) { return random.below(in) == 0; };
    form f{.layout = static_cast<trajectory_layout>(random.below(3))};
    const std::vector<std::string> separators{" ", "\t", "  ", ",", ", ", ";", " ; "};
    f.separator = separators[random.below(f.layout == kitti ? 3 : 7)];
    f.stamp_digits = 10 + 3 * static_cast<int>(random.below(4));
    if (f.layout == euroc && chance(2)) f.more = f.separator + "1.5" + f.separator + "-7";
    const std::size_t n = 20 + random.below(40);
    const trajectory poses = some_path(n, seed + 1000, 0.01 + 0.05 * random.uniform());
    std::string text = chance(4) ? "\xEF\xBB\xBF" : "";
    const std::string sharp = chance(2) ? "#" : "";
    if (f.layout == euroc) text += sharp + "time,tx,ty,tz,qw,qx,qy,qz\n";
    const bool like_euroc = f.separator[0] == ',' && f.stamp_digits == 19;  // without a header
    if (f.layout == tum && (like_euroc || chance(2))) text += sharp + "timestamp tx ty tz qx qy qz qw\n";

    trajectory wanted;
    std::size_t lost = 0, repeated = 0;
    std::vector<std::string> lines;
    for (std::size_t i = 0; i != n; ++i) {
      std::string line = line_of(poses[i], f);
      if (i != 0 && chance(8)) {
        const std::size_t last = line.find_last_of(f.separator) + 1;
        line = line.substr(0, last) + std::vector<std::string>{"nan", "-inf", "NaN", "-nan"}[random.below(4)] + "\n";
        if (!f.more.empty()) {  // in a column of the pose
          const std::size_t at = line.find(f.separator) + f.separator.size();
          line = line.substr(0, at) + "nan" + line.substr(line.find(f.separator, at));
        }
        ++lost;
      } else {
        wanted.push_back(poses[i]);
        if (f.layout == kitti) wanted.back().timestamp = static_cast<double>(i);
        if (f.layout != kitti && chance(10)) ++repeated, lines.push_back(line);
      }
      lines.push_back(line);
    }
    const bool swaps = f.layout != kitti && chance(2);
    if (swaps) std::swap(lines[5], lines[6]);
    for (std::string& line : lines) {
      if (chance(3)) line.insert(line.size() - 1, "\r");
      text += line + (chance(10) ? "\n" : "") + (chance(10) ? "# a comment\n" : "");
    }
    if (chance(2)) text.pop_back();
    INFO("seed " << seed << "\n" << text.substr(0, 400));
    const auto read = io::parse_trajectory_file(text).value();
    CHECK(read.layout == f.layout);
    CHECK(read.lost == lost);
    CHECK(same_poses(read.poses, wanted, f.stamp_digits == 13 ? 6e-4 : 2e-6));
    CHECK(has_note(read, std::to_string(lost) + " poses with NaN, infinity or a zero quaternion are left out") ==
          (lost != 0));
    CHECK(has_note(read, std::to_string(repeated) + " repeated lines") == (repeated != 0));
    CHECK(has_note(read, "the time stamps are in ") == (f.layout != kitti && f.stamp_digits != 10));
    CHECK_FALSE(has_note(read, "two runs"));
  }
}

TEST_CASE("of random runs in one file the first one is kept, and random times with too few digits are refused") {
  for (std::uint64_t seed = 0; seed != 60; ++seed) {
    orbis::random_bits random{seed};
    const double interval = random.uniform(0.01, 0.1);
    const trajectory first = some_path(30 + random.below(100), seed + 1, interval);
    trajectory second = some_path(30 + random.below(100), seed + 1000, random.uniform(0.01, 0.1));
    const double shift = random.below(2) == 0 ? 0.0 : random.uniform(-5.0, 0.5) * interval;
    for (stamped_pose& p : second) p.timestamp += shift;
    INFO("seed " << seed << ", shift " << shift);
    const auto two = io::parse_trajectory_file(text_of(first) + text_of(second)).value();
    CHECK(same_poses(two.poses, first));
    CHECK(has_note(two, "time runs backwards at line " + std::to_string(first.size() + 1) + "; two runs in one file?"));
    CHECK(has_note(two, std::to_string(second.size()) + " poses from there on are left out"));

    // Times rounded to steps that hold at least three poses.
    const double step = std::pow(10.0, std::ceil(std::log10(3.5 * interval)));
    trajectory coarse = first;
    for (stamped_pose& p : coarse) p.timestamp = step * std::floor(p.timestamp / step);
    const auto refused = io::parse_trajectory_file(text_of(coarse));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == orbis::errc::degenerate);
    CHECK(refused.error().message.find(step < 0.9 ? "too few digits" : "digits") != std::string::npos);
  }
}

TEST_CASE("poses without times get those of a file") {
  const orbis::test::temporary_folder folder;
  const trajectory poses = some_path(4, 1);
  std::string text = text_of(poses, {.layout = trajectory_layout::kitti});
  text.insert(text.find('\n') + 1, "nan nan nan nan nan nan nan nan nan nan nan nan\n");
  auto read = io::parse_trajectory_file(text).value();
  CHECK(read.lost == 1);
  const auto message = [&](const char* times) {
    const auto set = io::set_times(read, folder.write("times.txt", times));
    return set ? std::string{} : set.error().message;
  };
  CHECK(message("0\n1\n2\n3\n") == "4 time stamps for 5 poses");
  CHECK(message("0\n1\n1\n3\n4\n").find("later than the previous one") != std::string::npos);
  CHECK(message("0\n1\n2\n3\nx\n").find("one time") != std::string::npos);
  CHECK(io::set_times(read, folder / "none.txt").error().code == orbis::errc::not_found);
  CHECK(message("0\n1e-1\n0.25\n3\n4.5\n").empty());
  CHECK(read.poses[0].timestamp == 0.0);
  CHECK(read.poses[1].timestamp == 0.25);
  CHECK(read.poses[3].timestamp == 4.5);
}

TEST_CASE("units of time that make the spans of two trajectories agree are found") {
  const auto from = [](double begin, double end) { return trajectory{{begin, se3{}}, {end, se3{}}}; };
  CHECK(io::describe_units(from(0, 2000), from(0, 2)) == "the times of the first seem to be in milliseconds");
  CHECK(io::describe_units(from(5, 25), from(6e6, 24e6)) == "the times of the second seem to be in microseconds");
  CHECK(io::describe_units(from(1.4e18, 1.4e18 + 2e9), from(1.4e9, 1.4e9 + 2)) ==
        "the times of the first seem to be in nanoseconds");
  CHECK(io::describe_units(from(0, 2), from(1, 3)).empty());
  CHECK(io::describe_units(from(0, 2), from(100, 102)).empty());
  CHECK(io::describe_units({}, from(100, 102)).empty());
  CHECK(io::describe_spans(from(0, 2000.5), from(0, 2)) ==
        "0 to 2000.5 s and 0 to 2 s; the times of the first seem to be in milliseconds");
  CHECK(io::describe_spans({}, from(1, 2)) == "no time and 1 to 2 s");
}
