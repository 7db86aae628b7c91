// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/map_file-inl.hpp>
#include <orbis/slam/map_file.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

[[nodiscard]] result<slam::map> parsed(const std::string& bytes) {
  return slam::parse_map(std::as_bytes(std::span{bytes}), "some.map");
}
[[nodiscard]] std::string fault_of(const std::string& bytes) {
  const auto m = parsed(bytes);
  return m ? "" : m.error().to_string();
}

}  // namespace

TEST_CASE("A map that is written and read is the same map, and stays it whatever is done to both") {
  for (std::uint64_t seed = 100; seed < 106; ++seed) {
    random_bits random(seed);
    slam::map m = test::random_map(seed, 1200);
    const se3 T = test::random_motion(random);
    m.transform(sim3(T));  // poses with digits
    const std::string bytes = slam::map_bytes(m);
    auto again = parsed(bytes);
    REQUIRE(again.has_value());
    REQUIRE(test::fault_of(*again) == "");
    REQUIRE(slam::map_bytes(*again) == bytes);
    for (const auto& k : m.keyframes()) REQUIRE(again->at(k.id).rays == k.rays);
    random_bits same = random;
    for (int step = 0; step < 500; ++step) {
      test::change_somehow(random, m, 10);
      test::change_somehow(same, *again, 10);
    }
    REQUIRE(slam::map_bytes(*again) == slam::map_bytes(m));
  }
}

TEST_CASE("Small maps: nothing, nothing left, a keyframe without keypoints, a keypoint without a ray") {
  const auto round_trip = [](const slam::map& m) {
    const auto again = parsed(slam::map_bytes(m));
    REQUIRE(again.has_value());
    CHECK(slam::map_bytes(*again) == slam::map_bytes(m));
    CHECK(test::fault_of(*again) == "");
  };
  random_bits random(1);
  slam::map m(5, 1.3, 7);
  round_trip(m);
  slam::detail::insert_keyframe(m, test::random_frame(random, 0, 0), {});
  round_trip(m);
  CHECK(parsed(slam::map_bytes(m))->content().levels == 5);
  CHECK(parsed(slam::map_bytes(m))->content().min_shared == 7);
  m.erase_keyframe(0);
  round_trip(m);
  slam::map other(8, 1.2);
  auto f = test::random_frame(random, 2, 0);
  f.rays[1] = vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  f.depth[1] = 0.0F;
  slam::detail::insert_keyframe(other, f, {});
  round_trip(other);
}

TEST_CASE("Rays in a file are rays, and where there is none there is no depth") {
  using limits = std::numeric_limits<double>;
  const vec3 none = vec3::Constant(limits::quiet_NaN());
  const auto problem_of = [](const vec3& ray, float depth) {
    random_bits random(1);
    slam::map m(8, 1.2);
    auto f = test::random_frame(random, 2, 0);
    f.rays[1] = ray;
    f.depth[1] = depth;
    slam::detail::insert_keyframe(m, f, {});
    const auto again = parsed(slam::map_bytes(m));
    return again ? std::string() : again.error().to_string();
  };
  CHECK(problem_of(none, 0.0F).empty());
  CHECK(problem_of({1e29, -1e29, 1.0}, 0.0F).empty());
  for (const vec3& ray : {none, vec3{limits::infinity(), 0.0, 1.0}, vec3{0.0, -limits::infinity(), 1.0},
                          vec3{limits::quiet_NaN(), 0.0, limits::quiet_NaN()}, vec3{0.0, 1e300, 1.0}}) {
    INFO(ray.transpose());
    CHECK(problem_of(ray, 2.0F).find("keypoint 1 has an invalid ray") != std::string::npos);
  }
}

TEST_CASE("A file that is cut off says in which section") {
  const std::string bytes = slam::map_bytes(test::random_map(2, 60, 3));
  CHECK(fault_of("") == "some.map: not an orbis map: it does not begin with \"orbismap\"");
  CHECK(fault_of(bytes.substr(0, 10)) == "some.map: the file ends before the version number");
  CHECK(fault_of(bytes.substr(0, 20)) == "some.map: section \"size\" is missing: the file ends at byte 20");
  CHECK(fault_of(bytes.substr(0, 100)) ==
        "some.map: section \"kfrm\" from byte 60 is cut off: the file ends at byte 100");
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 100) {
    const auto cut = parsed(bytes.substr(0, size));
    REQUIRE_FALSE(cut.has_value());
    REQUIRE(cut.error().code == errc::malformed);
  }
  CHECK(fault_of(bytes + "x") == "some.map: unexpected data after the end at byte " + std::to_string(bytes.size()));
}

TEST_CASE("A file with one wrong bit says in which section") {
  const std::string bytes = slam::map_bytes(test::random_map(3, 60, 3));
  for (std::size_t at = 0; at < bytes.size(); at += 1 + at / 200) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (at % 8)));
    const auto m = parsed(damaged);
    REQUIRE_FALSE(m.has_value());
    if (at >= 12) REQUIRE(m.error().message.find("section \"") == 0);
  }
  std::string damaged = bytes;
  damaged[100] = static_cast<char>(damaged[100] ^ 1);
  CHECK(fault_of(damaged) == "some.map: section \"kfrm\" from byte 60 is damaged: checksum mismatch");
  std::string newer = bytes;
  newer[8] = 5;
  const auto m = parsed(newer);
  REQUIRE_FALSE(m.has_value());
  CHECK(m.error().code == errc::unsupported);
  CHECK(m.error().message == "version 5; only versions 1 to 4 are supported");
}

TEST_CASE("A file says what sensor the map was made with, and one of version 1 is read, which does not") {
  random_bits random(9);
  slam::map m(8, 1.2);
  auto f = test::random_frame(random, 5, 0);
  f.sensor = slam::sensor_kind::monocular;
  f.scale_is_known = false;
  m.add_keyframe(f);
  f.sensor = slam::sensor_kind::rgbd;  // that of the first one counts
  f.scale_is_known = true;
  m.add_keyframe(f);
  const std::string bytes = slam::map_bytes(m);
  const auto again = parsed(bytes);
  REQUIRE(again.has_value());
  CHECK(again->sensor() == slam::sensor_kind::monocular);
  CHECK(to_string(again->sensor()) == "monocular");
  CHECK_FALSE(again->scale_is_known());

  constexpr std::size_t head = 12, begin = head + 12, size = 24;  // of the section "size" in version 1
  std::string older = bytes.substr(0, head);
  older[8] = 1;
  slam::detail::put_section(older, "size", [&](std::string& to) { to += bytes.substr(begin, size); });
  older += bytes.substr(begin + size + 8 + 4);
  const auto old = parsed(older);
  CHECK((old ? "" : old.error().to_string()) == "");
  REQUIRE(old.has_value());
  CHECK(old->sensor() == slam::sensor_kind::unknown);
  CHECK(old->scale_is_known());
  CHECK(old->keyframes().size() == 2);

  std::string none = bytes.substr(0, head);
  slam::detail::put_section(none, "size", [&](std::string& to) {
    to += bytes.substr(begin, size);
    slam::detail::put(to, std::uint32_t{9});
  });
  CHECK(fault_of(none) == "some.map: invalid sensor kind 9");
}

TEST_CASE("Erased landmarks take few bytes of a file, in version 2 eight each") {
  random_bits random(12);
  slam::map m = test::random_map(12, 1200);
  const std::string few = slam::map_bytes(m);
  const slam::landmark_id last = m.landmark_end();
  auto content = m.content();
  content.landmarks.add_gone(1000000);
  const std::string many = slam::map_bytes(slam::map{content});
  CHECK(many.size() <= few.size() + 8);
  const auto again = parsed(many);
  REQUIRE(again.has_value());
  CHECK(again->landmark_end() == last + 1000000);
  CHECK(again->landmark_count() == m.landmark_count());
  CHECK(test::fault_of(*again) == "");

  // With so many that there is no place for them: new ids, and the same map otherwise.
  content.landmarks.add_gone(slam::detail::most_landmarks_of_file);
  slam::map full{content};
  const auto fresh = parsed(slam::map_bytes(full));
  REQUIRE(fresh.has_value());
  CHECK(fresh->landmark_end().value() == m.landmark_count());
  CHECK(fresh->landmark_ids_left() > 7 * slam::detail::most_landmarks_of_file);
  CHECK(test::fault_of(*fresh) == "");
  CHECK(fresh->keyframes().size() == m.keyframes().size());
  auto before = m.landmarks().begin();
  for (const auto& l : fresh->landmarks()) {
    REQUIRE(l.position == before->position);
    REQUIRE(l.observations == before->observations);
    ++before;
  }

  // As version 2 wrote it.
  std::string land, older = few;
  std::size_t gone = 0, replaced = 0;
  for (slam::landmark_id id = 0; id != last; ++id)
    if (m.has_landmark(id)) {
      slam::detail::put_landmark(land, m.landmark_at(id));
    } else {
      ++(m.replacement(id) == slam::no_id ? gone : replaced);
      slam::detail::put(land, std::uint32_t{0}, m.replacement(id).value());
    }
  CHECK(gone > 10);
  CHECK(replaced > 10);
  older.resize(few.rfind("land"));
  older[8] = 2;
  slam::detail::put_section(older, "land", [&](std::string& to) { to += land; });
  const auto old = parsed(older);
  CHECK((old ? "" : old.error().to_string()) == "");
  REQUIRE(old.has_value());
  CHECK(slam::map_bytes(*old) == few);
}

TEST_CASE("Keyframes that were forgotten are runs of ids, which versions before 4 do not have") {
  random_bits random(14);
  slam::map m = test::random_map(13, 3000);
  slam::keyframe_id kept = slam::no_id;
  for (slam::keyframe_id k = 20; k != m.keyframe_end() && kept == slam::no_id; ++k)
    if (!m.has_keyframe(k)) kept = k;
  REQUIRE(kept != slam::no_id);
  const std::size_t before = slam::map_bytes(m).size();
  const se3 T = m.pose(kept);
  m.forget_erased(std::vector{kept}, 3);
  REQUIRE(m.content().forgotten > 50);
  const std::string bytes = slam::map_bytes(m);
  CHECK(bytes.size() < before - 30 * m.content().forgotten);
  const auto again = parsed(bytes);
  CHECK((again ? "" : again.error().to_string()) == "");
  REQUIRE(again.has_value());
  CHECK(test::fault_of(*again) == "");
  CHECK(slam::map_bytes(*again) == bytes);
  CHECK(again->keyframe_end() == m.keyframe_end());
  CHECK(again->content().forgotten == m.content().forgotten);
  CHECK((again->pose(kept).inverse() * T).log().norm() < 1e-9);
  for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k) REQUIRE(again->remembers(k) == m.remembers(k));

  // However many there are, they cost nothing.
  constexpr std::uint32_t many = 200000000;
  auto content = m.content();
  content.keyframes.add_gone(many);
  content.forgotten += many;
  const slam::map long_lived{content};
  CHECK(slam::map_bytes(long_lived).size() <= bytes.size() + 5);
  const auto long_read = parsed(slam::map_bytes(long_lived));
  REQUIRE(long_read.has_value());
  CHECK(long_read->keyframe_end() == m.keyframe_end() + many);
  CHECK(test::fault_of(*long_read) == "");

  std::string older = bytes;
  older[8] = 3;
  CHECK(fault_of(older).find("invalid state") != std::string::npos);

  // Damage that fits its checksum: a run that is longer than what there is, or empty; a replacement that is forgotten.
  const auto with_keyframes = [&](std::uint32_t ids, const auto& put_all) {
    std::string file = slam::map_bytes(slam::map(8, 1.2)).substr(0, 12);
    slam::detail::put_section(file, "size", [&](std::string& to) {
      slam::detail::put(to, std::uint32_t{8}, std::uint32_t{15}, 1.2, ids, std::uint32_t{0}, std::uint32_t{0},
                        std::uint32_t{1});
    });
    slam::detail::put_section(file, "kfrm", put_all);
    slam::detail::put_section(file, "tree", [](std::string&) {});
    slam::detail::put_section(file, "land", [](std::string&) {});
    return file;
  };
  const auto run_of = [](std::uint32_t count) {
    return [count](std::string& to) { slam::detail::put(to, slam::detail::forgotten_keyframes, count); };
  };
  CHECK(fault_of(with_keyframes(7, run_of(7))) == "");
  constexpr std::uint32_t most = slam::detail::most_keyframes_of_file;
  CHECK(fault_of(with_keyframes(most, run_of(most))) == "");
  CHECK(fault_of(with_keyframes(most + 1, run_of(most + 1))) == "some.map: more ids than a file can hold");
  CHECK(fault_of(with_keyframes(7, run_of(8))) == "some.map: keyframe 0: invalid run of 8 forgotten keyframes");
  CHECK(fault_of(with_keyframes(7, run_of(0))) == "some.map: keyframe 0: invalid run of 0 forgotten keyframes");
  CHECK(fault_of(with_keyframes(2, [](std::string& to) {
          slam::detail::put(to, slam::detail::gone_keyframe, std::uint32_t{1});
          slam::detail::put_pose(to, se3{});
          slam::detail::put(to, slam::detail::forgotten_keyframes, std::uint32_t{1});
        })) == "some.map: keyframe 0: its replacement is not in the map");
}

TEST_CASE("Corrections of the scale are in the lengths that a file holds") {
  slam::map m = test::random_map(6, 600, 8);
  slam::keyframe_id gone;
  for (const auto& k : m.keyframes())
    if (k.id != m.tree().root()) gone = k.id;
  m.erase_keyframe(gone);
  m.transform(sim3(so3{}, vec3(1, 2, 3), 2.5));
  const auto again = parsed(slam::map_bytes(m));
  REQUIRE(again.has_value());
  CHECK((again->pose(gone).translation() - m.pose(gone).translation()).norm() < 1e-9);
  CHECK(again->scale(gone) == 1.0);
  CHECK(m.scale(gone) == 2.5);
}

TEST_CASE("Maps go to files and come back") {
  const auto path = std::filesystem::temp_directory_path() / "orbis_map_file_test.map";
  const slam::map m = test::random_map(4, 300);
  REQUIRE(slam::write_map(path, m).has_value());
  const auto again = slam::read_map(path);
  REQUIRE(again.has_value());
  CHECK(slam::map_bytes(*again) == slam::map_bytes(m));
  std::filesystem::resize_file(path, 1000);
  const auto cut = slam::read_map(path);
  REQUIRE_FALSE(cut.has_value());
  CHECK(cut.error().where == path.string());
  std::filesystem::remove(path);
  CHECK(slam::read_map(path).error().code == errc::not_found);
  CHECK(slam::write_map(path / "no" / "folder", m).error().code == errc::write_failed);
}

TEST_CASE("A rotation is read as it was written, bit for bit") {
  random_bits random(5);
  for (int i = 0; i < 1000; ++i) {
    const so3 r = test::random_motion(random).rotation() * test::random_motion(random).rotation();
    CHECK(so3::from_unit_quaternion(r.unit_quaternion()).unit_quaternion().coeffs() == r.unit_quaternion().coeffs());
  }
}
