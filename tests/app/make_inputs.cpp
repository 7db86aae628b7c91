// SPDX-License-Identifier: BSD-3-Clause
//
// make_inputs FOLDER FRAMES WIDTH: a synthetic recording as bags of ROS 1 and ROS 2 (room.bag, room) and as a video of
// two images side by side (pair.avi, if this build has a library for it) with camera.toml. Names the optional files
// that it made.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include <orbis/io/camera_file.hpp>
#include <orbis/io/synthetic.hpp>

#include "ros_bag_writer.hpp"

#ifdef RGBD_SLAM_VIDEO
#include <opencv2/videoio.hpp>
#endif

int main(int argc, char** argv) {
  if (argc != 4) return 1;
  const std::filesystem::path folder = argv[1];
  const int width = std::atoi(argv[3]);
  const orbis::io::synthetic_recording recording{
      {.frames = std::atoi(argv[2]), .width = width, .height = width / 4 * 3, .frames_around = 360}};
  std::filesystem::create_directories(folder);
  if (!orbis::io::write_camera(folder / "camera.toml", recording.stereo_camera())) return 1;

  // The second bag has depth of another camera, which is not registered to colour.
  std::filesystem::create_directories(folder / "room");
  orbis::test::ros_bag_writer registered{folder / "room.bag", 1}, bag{folder / "room" / "room_0.mcap", 2};
  const orbis::camera::pinhole depth_camera{{width, width / 2, 0.65 * width, 0.65 * width, 0.5 * width, 0.25 * width}};
  const orbis::se3 T_color_depth{orbis::so3::exp(orbis::vec3(0.01, -0.02, 0.015)), orbis::vec3(0.05, 0.005, -0.002)};
  for (std::size_t i = 0; i != recording.size(); ++i) {
    const auto frame = recording.frame(i).value();
    const orbis::se3 T_world_camera = recording.ground_truth()[i].T_world_camera;
    const double t = 1000.0 + frame.timestamp;
    orbis::image<float> depth(frame.depth.width(), frame.depth.height());
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) depth(x, y) = static_cast<float>(frame.depth(x, y) / frame.depth_scale);
    registered.image("/camera/color/image_raw", t, "rgb8", frame.color.view());
    registered.image<float>("/camera/depth_registered/image", t, "32FC1", depth.view());

    const auto raw = recording.exact_depth(orbis::seq, depth_camera, T_world_camera * T_color_depth);
    orbis::image<std::uint16_t> millimetres(raw.width(), raw.height());
    for (int y = 0; y != raw.height(); ++y)
      for (int x = 0; x != raw.width(); ++x) millimetres(x, y) = static_cast<std::uint16_t>(1000.0F * raw(x, y) + 0.5F);
    bag.frame = "camera";
    bag.image("/camera/color/image_raw", t, "rgb8", frame.color.view());
    bag.odometry("/odom", t, T_world_camera);
    bag.frame = "depth";
    bag.image<std::uint16_t>("/camera/depth/image_rect_raw", t, "16UC1", millimetres.view());
  }
  bag.info("/camera/depth/camera_info", 1000.0, depth_camera.k());
  bag.frame = "camera";
  bag.transform("/tf_static", 1000.0, "depth", T_color_depth);
  for (orbis::test::ros_bag_writer* to : {&registered, &bag}) {
    to->info("/camera/color/camera_info", 1000.0, recording.camera().model.k());
    to->close();
  }
#ifdef RGBD_SLAM_VIDEO
  const int height = width / 4 * 3;
  cv::VideoWriter video{
      (folder / "pair.avi").string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30.0, {2 * width, height}};
  if (!video.isOpened()) return 1;
  for (std::size_t i = 0; i != recording.size(); ++i) {
    const auto pair = recording.stereo_frame(i).value();
    cv::Mat both(height, 2 * width, CV_8UC3);
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != 2 * width; ++x) {
        const orbis::rgb8& p = x < width ? pair.left(x, y) : pair.right(x - width, y);
        both.at<cv::Vec3b>(y, x) = {p.b, p.g, p.r};
      }
    video.write(both);
  }
  std::puts("pair.avi");
#endif
  return 0;
}
