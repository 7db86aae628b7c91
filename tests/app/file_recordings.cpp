// SPDX-License-Identifier: BSD-3-Clause
//
// Videos, as far as this build has a library for them, and ROS 1 bags; see bags.cpp for the containers.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/io/png.hpp>

#include "inputs/file_recording.hpp"
#include "inputs/ros_images.hpp"
#include "inputs/ros_messages.hpp"
#include "io/recordings.hpp"
#include "ros_bag_writer.hpp"
#include "support/catch.hpp"

#ifdef RGBD_SLAM_VIDEO
#include <opencv2/videoio.hpp>
#endif

using namespace orbis;
using Catch::Matchers::Contains;
using slam::sensor_kind;
using test::message_of;
using test::temporary_folder;

namespace {

[[maybe_unused]] constexpr camera::intrinsics k{32, 24, 30.0, 30.0, 15.5, 11.5};
[[maybe_unused]] const camera::camera_settings settings{.model = camera::pinhole{k}, .baseline = 0.1};

}  // namespace

TEST_CASE("a build without a library says which one is missing") {
  const temporary_folder folder;
  folder.write("a.bag", "");
  if (!app::has_videos())
    CHECK_THAT(message_of(app::open_video(folder.path() / "a.bag", {})), Contains("libopencv-videoio-dev"));
  CHECK(!app::open_bag(folder.path() / "a.bag", {}));
  CHECK(!app::open_video(folder.path() / "a.bag", {.camera = settings}));
}

#ifdef RGBD_SLAM_VIDEO
namespace {

/// Frames whose grey value is 20 more from one to the next, and 10 more in the right half.
std::filesystem::path write_video(const temporary_folder& folder, int frames, int width) {
  const auto path = folder.path() / "video.avi";
  cv::VideoWriter writer{path.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 12.5, {width, k.height}};
  REQUIRE(writer.isOpened());
  for (int i = 0; i != frames; ++i) {
    cv::Mat image(k.height, width, CV_8UC3, cv::Scalar(40 + 20 * i, 50, 60));
    image.colRange(width / 2, width) += cv::Scalar(10, 0, 0);
    writer.write(image);
  }
  return path;
}

bool is_near(const rgb8& a, int r, int g, int b) {
  return std::abs(a.r - r) < 8 && std::abs(a.g - g) < 8 && std::abs(a.b - b) < 8;
}

}  // namespace

TEST_CASE("a video is read forwards and backwards with the container's times") {
  const temporary_folder folder;
  const auto path = write_video(folder, 6, 32);
  const auto video = app::open_video(path, {.camera = settings}).value();
  REQUIRE(video->size() == 6);
  CHECK(video->sensor == sensor_kind::monocular);
  CHECK(video->notes.empty());
  for (const std::size_t i : {0U, 1U, 5U, 2U, 2U}) {
    const auto frame = video->frame(i).value();
    CHECK(frame.timestamp - video->frame(0).value().timestamp == Approx(0.08 * static_cast<double>(i)));
    CHECK(is_near(frame.color(4, 4), 60, 50, 40 + 20 * static_cast<int>(i)));
    CHECK(frame.depth.empty());
    CHECK(video->color(i).value() == frame.color);
  }
}

TEST_CASE("a video of two images side by side is a stereo recording") {
  const temporary_folder folder;
  const auto path = write_video(folder, 2, 64);
  const auto video = app::open_video(path, {.sensor = sensor_kind::stereo, .camera = settings}).value();
  const auto frame = video->frame(1).value();
  CHECK(frame.color.width() == 32);
  CHECK(is_near(frame.color(20, 4), 60, 50, 60));
  CHECK(is_near(frame.right(8, 4), 60, 50, 70));
  CHECK_THAT(message_of(app::open_video(path, {.camera = settings})),
             Contains("64x24 pixels, but the camera has 32x24"));
  auto lone = settings;
  lone.baseline.reset();
  CHECK_THAT(message_of(app::open_video(path, {.sensor = sensor_kind::stereo, .camera = lone})), Contains("baseline"));
}

TEST_CASE("what is no video or has no camera is refused in words") {
  const temporary_folder folder;
  CHECK_THAT(message_of(app::open_video(folder.path() / "none.avi", {})), Contains("no such file"));
  folder.write("notes.txt", "hello");
  CHECK_THAT(message_of(app::open_video(folder.path() / "notes.txt", {.camera = settings})),
             Contains("not a folder, a bag, or a video that"));
  const auto path = write_video(folder, 2, 32);
  CHECK_THAT(message_of(app::open_video(path, {})), Contains("put a camera.toml next to the video"));
  CHECK_THAT(message_of(app::open_video(path, {.sensor = sensor_kind::rgbd})), Contains("no depth"));
  folder.write("camera.toml", "model = 'pinhole'\nwidth = 32\nheight = 24\nfx = 30\nfy = 30\ncx = 15.5\ncy = 11.5\n");
  const auto video = app::open_video(path, {}).value();
  CHECK(video->size() == 2);
  CHECK(video->files == std::vector<std::filesystem::path>{path, folder.path() / "camera.toml"});
}
#else
TEST_CASE("videos") { WARN("[skipped] this build reads no videos"); }
#endif

namespace {

image<rgb8> plain(std::uint8_t r, std::uint8_t g, std::uint8_t b, int width = 32) { return {width, 24, {r, g, b}}; }

template <class T>
image_view<const T> view(const image<T>& im) {
  return im.view();
}

}  // namespace

TEST_CASE("colour and depth of a bag are found and paired by the times in their headers") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const bool in_metres = GENERATE(false, true);
  {
    test::ros_bag_writer bag{path};
    bag.info("/camera/rgb/camera_info", 1.0, k);
    for (int i = 0; i != 3; ++i) {
      const double t = 1.0 + 0.1 * i;
      bag.image("/camera/rgb/image_color", t, "bgr8", view(plain(static_cast<std::uint8_t>(i), 20, 30)));
      bag.image("/camera/rgb/image_mono", t, "mono8", view(image<std::uint8_t>(32, 24, 9)));
      if (i == 1) continue;
      if (in_metres)
        bag.image("/camera/depth_registered/image", t + 0.01, "32FC1", view(image<float>(32, 24, i == 0 ? NAN : 1.5F)));
      else
        bag.image("/camera/depth_registered/image", t + 0.01, "16UC1", view(image<std::uint16_t>(32, 24, 1500)));
      bag.image("/camera/depth/image_raw", t, "16UC1", view(image<std::uint16_t>(16, 12, 1)));
    }
    bag.close();
  }
  const auto bag = app::open_bag(path, {}).value();
  CHECK(bag->sensor == sensor_kind::rgbd);
  REQUIRE(bag->size() == 2);
  CHECK(bag->images_of == "/camera/rgb/image_color and /camera/depth_registered/image");
  CHECK(bag->notes.size() == 1);  // an image without a partner
  CHECK(bag->camera.model.k() == k);
  CHECK(bag->camera.model.model_name() == "pinhole");
  const auto frame = bag->frame(1).value();
  CHECK(frame.timestamp == Approx(1.2).epsilon(1e-12));
  CHECK(frame.color(31, 23) == rgb8{30, 20, 2});
  CHECK(frame.depth_scale == (in_metres ? 5000.0 : 1000.0));
  CHECK(frame.depth(31, 23) == (in_metres ? 7500 : 1500));
  CHECK(bag->frame(0).value().depth(5, 5) == (in_metres ? 0 : 1500));
  CHECK(bag->color(1).value() == frame.color);

  CHECK(app::open_bag(path, {.sensor = sensor_kind::monocular}).value()->size() == 3);
  CHECK(app::open_bag(path, {.topics = {"/camera/rgb/image_mono"}}).value()->color(0).value()(1, 1) == rgb8{9, 9, 9});
  CHECK_THAT(message_of(app::open_bag(path, {.topics = {"/camera/rgb/image_color", "/camera/depth/image_raw"}})),
             Contains("16x12 pixels, but the camera has 32x24: depth is not registered"));
  CHECK_THAT(message_of(app::open_bag(path, {.topics = {"/camera/depth_registered/image", "/camera/rgb/image_color"}})),
             Contains("specify the colour topic first"));
  CHECK_THAT(message_of(app::open_bag(path, {.topics = {"/nothing"}})),
             Contains("has no images in /nothing; it contains /camera/depth/image_raw (16UC1)"));
  CHECK_THAT(message_of(app::open_bag(path, {.sensor = sensor_kind::stereo})), Contains("has no suitable images"));
}

TEST_CASE("the images of a stereo camera in a bag are rectified if they are not") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const bool is_rectified = GENERATE(false, true);
  const std::string image_name = is_rectified ? "image_rect" : "image_raw";
  const std::vector<double> distortion =
      is_rectified ? std::vector<double>{0, 0, 0, 0, 0} : std::vector<double>{-0.3, 0.01, 0, 0, 0};
  image<std::uint8_t> left(32, 24);
  for (int y = 0; y != 24; ++y)
    for (int x = 0; x != 32; ++x) left(x, y) = static_cast<std::uint8_t>(4 * x);
  {
    test::ros_bag_writer bag{path};
    for (int i = 0; i != 2; ++i) {
      const double t = 5.0 + 0.05 * i;
      bag.image("/stereo/left/" + image_name, t, "mono8", view(left));
      bag.image("/stereo/right/" + image_name, t + 0.001, "mono8", view(image<std::uint8_t>(32, 24, 120)));
      bag.info("/stereo/left/camera_info", t, k, 0.0, distortion);
      bag.info("/stereo/right/camera_info", t, k, 30.0 * 0.25, distortion);
    }
    bag.close();
  }
  const auto bag = app::open_bag(path, {}).value();
  CHECK(bag->sensor == sensor_kind::stereo);
  REQUIRE(bag->size() == 2);
  CHECK(bag->camera.baseline.value() == Approx(0.25));
  CHECK(bag->camera.model.model_name() == "pinhole");
  CHECK(bag->camera.fps == Approx(20.0));
  const auto frame = bag->frame(1).value();
  CHECK((frame.color(2, 12).g == 8) == is_rectified);  // pulled outwards by the lens, otherwise
  CHECK(frame.color(2, 12).g < 16);
  CHECK(frame.right(16, 12) == rgb8{120, 120, 120});
  const auto specified = app::open_bag(path, {.camera = settings}).value();
  CHECK(specified->camera.baseline == 0.1);
  CHECK(specified->notes.size() == (is_rectified ? 0 : 1));
  if (!is_rectified)
    CHECK_THAT(specified->notes[0],
               Contains("image_raw and /stereo/right/image_raw are used as if they were rectified"));
}

TEST_CASE("bags with one camera give compressed images and lenses") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  {
    test::ros_bag_writer bag{path};
    bag.compressed("/cam/image_raw/compressed", 3.0, "png", io::encode_png(plain(1, 2, 3)));
    bag.info("/cam/camera_info", 3.0, k, 0.0, {-0.1, 0.01, 0.001, 0.002, 0.003});
    bag.close();
  }
  const auto bag = app::open_bag(path, {}).value();
  CHECK(bag->sensor == sensor_kind::monocular);
  CHECK(bag->frame(0).value().color(3, 3) == rgb8{1, 2, 3});
  const auto* lens = bag->camera.model.get_if<camera::radial_tangential>();
  REQUIRE(lens != nullptr);
  CHECK(lens->distortion().p2 == 0.002);
  CHECK(lens->distortion().k3 == 0.003);
}

TEST_CASE("the topics of librealsense's bags are found") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const auto write = [&](const camera::intrinsics& of_depth, const char* units = nullptr) {
    test::ros_bag_writer bag{path};
    bag.frame = "0";  // of all images
    bag.distortion_model = "Inverse Brown Conrady";
    bag.number("/device_0/sensor_0/option/Laser_Power/value", 0.0, 150.0F);
    bag.number("/device_0/sensor_1/option/Depth_Units/value", 0.0, 0.5F);  // of another sensor
    if (units != nullptr) bag.number(std::string{"/device_0/sensor_0/option/"} + units + "/value", 0.0, 0.00025F);
    const std::string color = "/device_0/sensor_1/Color_0/", depth = "/device_0/sensor_0/Depth_0/";
    bag.info(depth + "info/camera_info", 1.0, of_depth);
    bag.info(color + "info/camera_info", 1.0, k);
    bag.image(color + "image/data", 1.0, "rgb8", view(plain(1, 2, 3)));
    bag.image(depth + "image/data", 1.0, "mono16", view(image<std::uint16_t>(of_depth.width, of_depth.height, 1500)));
    bag.image("/device_0/sensor_0/Infrared_1/image/data", 1.0, "mono16", view(image<std::uint16_t>(32, 24, 7)));
    bag.close();
  };
  write({16, 12, 15.0, 15.0, 7.5, 5.5});
  CHECK_THAT(message_of(app::open_bag(path, {})),
             Contains("16x12 pixels, but the camera has 32x24: depth is not registered to colour") &&
                 Contains("these names do not identify frames"));
  write(k);
  const auto bag = app::open_bag(path, {}).value();
  CHECK(bag->sensor == sensor_kind::rgbd);
  CHECK(bag->camera.model.k() == k);
  CHECK(bag->frame(0).value().depth(3, 3) == 1500);
  CHECK(bag->camera.depth_scale == 1000.0);
  REQUIRE(bag->notes.size() == 2);
  CHECK_THAT(bag->notes[0], Contains("does not specify the depth unit of /device_0/sensor_0/Depth_0/image/data"));
  CHECK_THAT(bag->notes[1], Contains("registered"));  // no transform between the cameras
  for (const char* units : {"Depth Units", "Depth_Units"}) {
    write(k, units);
    const auto known = app::open_bag(path, {}).value();
    CHECK(known->camera.depth_scale == 4000.0);
    CHECK(known->frame(0).value().depth_scale == 4000.0);
    CHECK(known->notes.size() == 1);
    CHECK_THAT(app::open_bag(path, {.camera = settings}).value()->notes.at(0),
               Contains("the bag stores 4000 depth units per metre; the specified camera has 1000"));
  }
}

TEST_CASE("the distortion of a message becomes that of the camera, or an error") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const auto open = [&](const std::string& model, const std::vector<double>& distortion) {
    test::ros_bag_writer bag{path};
    bag.distortion_model = model;
    bag.image("/cam/image_raw", 1.0, "rgb8", view(plain(1, 2, 3)));
    bag.info("/cam/camera_info", 1.0, k, 0.0, distortion);
    bag.close();
    return app::open_bag(path, {});
  };
  const auto equidistant = open("equidistant", {0.1, 0.02, 0.003, 0.0004}).value();
  REQUIRE(equidistant->camera.model.get_if<camera::kannala_brandt>() != nullptr);
  CHECK(equidistant->camera.model.get_if<camera::kannala_brandt>()->distortion() ==
        camera::kannala_brandt::coefficients{0.1, 0.02, 0.003, 0.0004});
  for (const std::size_t n : {8U, 12U, 14U}) {
    std::vector<double> d{0.1, 0.2, 0.03, 0.04, 0.5, 0.6, 0.7, 0.8};
    d.resize(n);
    const auto rational = open("rational_polynomial", d).value();
    const auto* lens = rational->camera.model.get_if<camera::radial_tangential>();
    REQUIRE(lens != nullptr);
    CHECK(lens->distortion().k1 == 0.1);
    CHECK(lens->distortion().p2 == 0.04);
    CHECK(lens->distortion().k3 == 0.5);
    CHECK(lens->distortion().k6 == 0.8);
    if (n == 8) continue;
    d.back() = 0.01;
    CHECK_THAT(message_of(open("rational_polynomial", d)), Contains("is not supported"));
  }
  CHECK(open("Brown Conrady", {0.1, 0.2, 0.03, 0.04, 0.5})
            .value()
            ->camera.model.get_if<camera::radial_tangential>()
            ->distortion()
            .k3 == 0.5);
  CHECK(open("Inverse Brown Conrady", {0, 0, 0, 0, 0}).value()->camera.model.model_name() == "pinhole");
  CHECK_THAT(
      message_of(open("Inverse Brown Conrady", {0.1, 0, 0, 0, 0})),
      Contains("\"Inverse Brown Conrady\" with 5 coefficients is not supported") && Contains("; specify a camera"));
}

TEST_CASE("colour and depth of one camera are chosen, with a calibrated camera if there is one") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const auto chosen = [&](const auto& write) {
    test::ros_bag_writer bag{path};
    const auto images = [&](const std::string& topic, const std::string& frame, auto pixel, bool has_camera = true) {
      constexpr bool is_depth = sizeof pixel == 2;
      bag.frame = frame;
      bag.image(topic, 1.0, is_depth ? "16UC1" : "rgb8", view(image<decltype(pixel)>(32, 24, pixel)));
      if (has_camera) bag.info(topic.substr(0, topic.rfind('/')) + "/camera_info", 1.0, k);
    };
    write(images);
    bag.close();
    return app::open_bag(path, {}).value();
  };
  const rgb8 color{1, 2, 3};
  const std::uint16_t depth = 900;
  const auto by_frame = chosen([&](const auto& images) {
    images("/a/color/image", "a", color);
    images("/a/depth/image", "a_depth", depth);
    images("/b/color/image", "b", color);
    images("/c/depth/image", "b", depth);
  });
  CHECK(by_frame->images_of == "/b/color/image and /c/depth/image");
  CHECK(by_frame->notes.empty());
  const auto by_name = chosen([&](const auto& images) {
    images("/a/color/image", "a", color);
    images("/b/color/image", "b", color);
    images("/b/depth/image", "b_depth", depth);
  });
  CHECK(by_name->images_of == "/b/color/image and /b/depth/image");
  const auto of_infrared = chosen([&](const auto& images) {
    images("/camera/color/image_raw", "color", color);
    images("/camera/aligned_depth_to_infra1/image_raw", "infra1", depth);
  });
  CHECK_THAT(of_infrared->notes.at(0), Contains("may not be (depth in the frame \"infra1\", colour in \"color\""));
  const auto calibrated = chosen([&](const auto& images) {
    images("/a/image", "a", color, false);
    images("/a/depth", "a", depth, false);
    images("/b/image", "b", color);
    images("/b/image_depth", "b", depth);
    images("/b/image_ir", "b", depth);
    images("/b/confidence/image", "b", depth);
  });
  CHECK(calibrated->images_of == "/b/image and /b/image_depth");

  test::ros_bag_writer bag{path};
  bag.info("/left/camera_info", 1.0, k);
  bag.image("/left/image", 1.0, "rgb8", view(plain(1, 2, 3)));
  bag.image("/right/image", 1.0, "bayer_rggb16", 32, 24, 64, std::string(64 * 24, '\0'));  // not supported
  bag.close();
  CHECK(app::open_bag(path, {}).value()->images_of == "/left/image");
}

TEST_CASE("of a bag with images in hundreds of topics the user must choose") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  test::ros_bag_writer bag{path};
  bag.info("/cam7/camera_info", 1.0, k);
  for (int i = 0; i != 501; ++i)
    bag.image("/cam" + std::to_string(i) + "/image_raw", 1.0, "rgb8", view(plain(1, 2, 3)));
  bag.close();
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("a.bag: contains images in more than 500 topics"));
  CHECK(app::open_bag(path, {.topics = {"/cam7/image_raw"}}).value()->camera.model.k() == k);
}

TEST_CASE("the camera of compressed images is next to them or one level higher") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  test::ros_bag_writer bag{path};
  bag.compressed("/front/left/image_compressed", 3.0, "png", io::encode_png(plain(1, 2, 3)));
  bag.info("/front/left/camera_info", 3.0, k);
  bag.info("/front/camera_info", 3.0, {32, 24, 99.0, 99.0, 15.5, 11.5});
  bag.close();
  CHECK(app::open_bag(path, {}).value()->camera.model.k() == k);
}

TEST_CASE("of times that fall back the first run is used, and repeated times are omitted, with notes") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  test::ros_bag_writer bag{path};
  bag.info("/cam/camera_info", 1.0, k);
  std::uint8_t value = 0;
  // 2.9 and 2.9 repeat; from 0.5 on, a second run.
  for (const double t : {1.0, 2.0, 3.0, 2.9, 2.9, 0.5, 1.5, 9.0})
    bag.image("/cam/image_raw", t, "rgb8", view(plain(++value, 0, 0)));
  bag.close();
  const auto found = app::open_bag(path, {}).value();
  REQUIRE(found->size() == 4);
  for (const auto& [i, t, r] : {std::tuple{0U, 1.0, 1}, {1U, 2.0, 2}, {2U, 2.9, 4}, {3U, 3.0, 3}}) {
    const auto frame = found->frame(i).value();
    CHECK(frame.timestamp == Approx(t).epsilon(1e-12));
    CHECK(frame.color(3, 3).r == r);
  }
  REQUIRE(found->notes.size() == 2);
  CHECK_THAT(found->notes[0],
             Contains("3 images of /cam/image_raw are omitted because the times in the headers jump back"));
  CHECK_THAT(found->notes[1], Contains("1 image of /cam/image_raw is omitted because another image has the same time"));
}

TEST_CASE("ground truth is that of the named topic and damaged poses are omitted") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  test::ros_bag_writer bag{path};
  bag.info("/cam/camera_info", 1.0, k);
  const auto at = [](double x) { return se3{so3{}, vec3(x, 0, 0)}; };
  bag.frame = "base";
  bag.transform("/tf_static", 0.0, "camera", at(100.0));
  bag.transform("/tf_static", 0.5, "camera", at(50.0));  // the latest one applies
  for (int i = 0; i != 3; ++i) {
    const double t = 1.0 + 0.1 * i;
    bag.frame = "camera";
    bag.image("/cam/image_raw", t, "rgb8", view(plain(1, 2, 3)));
    bag.frame = "world";
    bag.transform("/tf", t, "base", at(1.0 + i));
    bag.transform("/other/tf", t, "base", at(7.0));
    bag.odometry("/odom", t, i == 1 ? at(NAN) : at(i));
  }
  bag.close();
  const auto found = app::open_bag(path, {.truth_topic = "/tf"}).value();
  CHECK(found->notes.empty());
  REQUIRE(found->ground_truth.size() == 3);
  for (std::size_t i = 0; i != 3; ++i)
    CHECK(found->ground_truth[i].T_world_camera.translation().x() == Approx(51.0 + static_cast<double>(i)));
  CHECK_THAT(message_of(app::open_bag(path, {.truth_topic = "/other/tf"})),
             Contains("no transform of /other/tf moves the camera's frame \"camera\", whose root is \"world\""));
  const auto odometry = app::open_bag(path, {.truth_topic = "/odom"}).value();
  CHECK(odometry->ground_truth.size() == 2);
  CHECK_THAT(odometry->notes.at(0), Contains("1 pose of /odom is damaged and omitted"));
}

TEST_CASE("a message of ROS 2 in big-endian order is read") {
  std::string bytes{"\0\0\0\0", 4};  // CDR, big endian
  const auto number = [&](auto value) {
    while (bytes.size() % sizeof value != 0) bytes += '\0';
    for (std::size_t i = sizeof value; i-- != 0;) bytes += static_cast<char>(value >> (8 * i));
  };
  const auto text = [&](const std::string& t) {
    number(static_cast<std::uint32_t>(t.size() + 1));
    bytes += t + '\0';
  };
  for (const std::uint32_t seconds_then_nanoseconds : {5U, 7U}) number(seconds_then_nanoseconds);
  text("camera");
  for (const std::uint32_t height_then_width : {2U, 3U}) number(height_then_width);
  text("16UC1");
  bytes += '\1';  // the pixels are big-endian, too
  for (const std::uint32_t step_then_size : {6U, 12U}) number(step_then_size);
  for (std::uint16_t i = 0; i != 6; ++i) number(static_cast<std::uint16_t>(1000 + i));
  const auto m = app::ros_messages::parse<app::ros_messages::image>(bytes, app::message_encoding::cdr, "a").value();
  CHECK(m.header.stamp == 5'000'000'007);
  CHECK(m.header.frame_id == "camera");
  const auto depth = app::decode_depth(m, "a").value();
  CHECK(depth(0, 0) == 1000);
  CHECK(depth(2, 0) == 1002);
  CHECK(depth(2, 1) == 1005);
}

TEST_CASE("big-endian depth and colours of four channels have the right values") {
  using app::ros_messages::image;
  const std::string metres{"\x3f\xc0\0\0", 4};  // 1.5
  CHECK(app::decode_depth(image{{}, 1, 1, "32FC1", 1, 4, metres}, "a").value()(0, 0) == 7500);
  const std::string pixels{"\1\2\3\xff\4\5\6\0", 8};
  const auto color = [&](const char* encoding) {
    return app::decode_color(image{{}, 1, 2, encoding, 0, 8, pixels}, "a").value();
  };
  CHECK(color("rgba8")(0, 0) == rgb8{1, 2, 3});
  CHECK(color("rgba8")(1, 0) == rgb8{4, 5, 6});
  CHECK(color("bgra8")(0, 0) == rgb8{3, 2, 1});
  CHECK(color("bgra8")(1, 0) == rgb8{6, 5, 4});
}

TEST_CASE("the mosaic of a colour filter becomes a colour image") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  // The colours of the upper left four pixels.
  const std::string order = GENERATE("rggb", "bggr", "gbrg", "grbg");
  {
    test::ros_bag_writer bag{path};
    image<std::uint8_t> mosaic(32, 24);
    for (int y = 0; y != 24; ++y)
      for (int x = 0; x != 32; ++x) {
        const char color = order[static_cast<std::size_t>(2 * (y % 2) + x % 2)];
        mosaic(x, y) = color == 'r' ? 200 : color == 'g' ? 100 : 50;
      }
    bag.image("/cam/image_raw", 1.0, "bayer_" + order + "8", view(mosaic));
    bag.image("/cam/image_mono", 1.0, "mono8", view(image<std::uint8_t>(32, 24, 9)));  // less is known by it
    bag.info("/cam/camera_info", 1.0, k);
    bag.close();
  }
  const auto color = app::open_bag(path, {}).value()->color(0).value();
  for (const auto& [x, y] : {std::pair{4, 4}, {5, 4}, {4, 5}, {31, 23}, {0, 0}})
    CHECK(color(x, y) == rgb8{200, 100, 50});
}

TEST_CASE("compressed depth is read, in millimetres and in metres") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const float a = 30000.0F, b = -5.5F;  // stored = a / z + b
  image<std::uint16_t> millimetres(32, 24, 1500), inverse(32, 24);
  millimetres(3, 4) = 0;
  for (int y = 0; y != 24; ++y)
    for (int x = 0; x != 32; ++x)
      inverse(x, y) = static_cast<std::uint16_t>(std::lround(a / (0.5F + 0.1F * static_cast<float>(x)) + b));
  inverse(3, 4) = 0;
  const auto write = [&](const std::string& format, const image<std::uint16_t>& pixels, float scale, bool has_header) {
    test::ros_bag_writer bag{path};
    std::string data(has_header ? 12 : 0, '\0');
    if (has_header) std::memcpy(&data[4], &scale, 4), std::memcpy(&data[8], &b, 4);
    bag.compressed(has_header ? "/cam/aligned_depth/compressedDepth" : "/cam/aligned_depth/compressed", 3.0, format,
                   data + io::encode_png(pixels.view()));
    bag.image("/cam/image_raw", 3.0, "rgb8", view(plain(1, 2, 3)));
    bag.info("/cam/camera_info", 3.0, k);
    bag.close();
  };
  for (const bool has_header : {false, true}) {
    write(has_header ? "16UC1; compressedDepth png" : "16UC1; png compressed ", millimetres, 0.0F, has_header);
    const auto bag = app::open_bag(path, {}).value();
    CHECK(bag->sensor == sensor_kind::rgbd);
    CHECK(bag->camera.depth_scale == 1000.0);
    CHECK(bag->frame(0).value().depth == millimetres);
  }
  write("32FC1; compressedDepth", inverse, a, true);
  const auto bag = app::open_bag(path, {}).value();
  CHECK(bag->camera.depth_scale == 5000.0);
  const auto depth = bag->frame(0).value().depth;
  for (int x = 0; x != 32; ++x) CHECK(depth(x, 9) / 5000.0 == Approx(0.5 + 0.1 * x).epsilon(1e-3));
  CHECK(depth(3, 4) == 0);

  write("32FC1; compressedDepth png", inverse, 0.0F, true);
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("the header of a compressed depth image has no scale"));
  write("16UC1; compressedDepth rvl", millimetres, 0.0F, true);
  CHECK_THAT(message_of(app::open_bag(path, {})),
             Contains("compressed depth in the format \"16UC1; compressedDepth rvl\" is not supported"));
  write("png", millimetres, 0.0F, true);  // what is in it is not said
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("in the format \"png\" is not supported"));
}

TEST_CASE("only a name that says so is that of a rectified image") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const auto model = [&](const std::string& topic) {
    test::ros_bag_writer bag{path};
    bag.image(topic, 1.0, "rgb8", view(plain(1, 2, 3)));
    bag.info(topic.substr(0, topic.rfind('/')) + "/camera_info", 1.0, k, 0.0, {-0.1, 0.01, 0, 0, 0});
    bag.close();
    return std::string{app::open_bag(path, {}).value()->camera.model.model_name()};
  };
  CHECK(model("/cam/image_rect_color") == "pinhole");
  CHECK(model("/cam/image_rect") == "pinhole");
  CHECK(model("/direct/image_raw") == "radtan");
  CHECK(model("/corrected/image_raw") == "radtan");
}

TEST_CASE("damaged bags and images are refused in words") {
  const temporary_folder folder;
  const auto path = folder.path() / "a.bag";
  const auto write = [&](const std::string& encoding, bool has_camera, int height) {
    test::ros_bag_writer bag{path};
    bag.image("/cam/image_raw", 1.0, encoding, 32, height, 96, std::string(96 * 24, '\0'));
    if (has_camera) bag.info("/cam/camera_info", 1.0, k);
    bag.close();
  };
  write("rgb8", true, 24);
  CHECK(app::open_bag(path, {}));
  write("rgb8", true, 25);
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("/cam/image_raw: an image has fewer pixels"));
  write("rgb8", true, 23);
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("32x23 pixels, but the camera has 32x24"));
  write("rgb8", false, 24);
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("no sensor_msgs/CameraInfo for /cam/image_raw"));
  CHECK(app::open_bag(path, {.camera = settings}));
  write("bayer_rggb16", true, 24);
  CHECK_THAT(message_of(app::open_bag(path, {})),
             Contains("in a supported encoding") && Contains("/cam/image_raw (bayer_rggb16)"));
  CHECK_THAT(message_of(app::open_bag(path, {.topics = {"/cam/image_raw"}})),
             Contains("the encoding bayer_rggb16 is not supported"));
  folder.write("b.bag", "#ROSBAG V2.0\nand then nothing");
  CHECK_THAT(message_of(app::open_bag(folder.path() / "b.bag", {})),
             Contains("the bag contains no images") && Contains("truncated, damaged or was not closed"));
  folder.write("d.bag", "something else");
  CHECK_THAT(message_of(app::open_bag(folder.path() / "d.bag", {})), Contains("is not a readable bag"));
  CHECK_THAT(message_of(app::open_bag(folder.path() / "c.bag", {})), Contains("no such file"));
  {
    test::ros_bag_writer bag{path};
    bag.info("/cam/camera_info", 1.0, k);
    bag.close();
  }
  CHECK_THAT(message_of(app::open_bag(path, {})), Contains("the bag contains no images"));
}
