#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the ROS 1 bags of this folder with rosbag, as make_bags.mjs writes the others."""
import os
import shutil
import struct
import zlib

import rosbag
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from genpy import Time
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage

EPOCH, LATE = 1700000000, 0.25  # seconds; messages are recorded later than they are taken


def stamp(t):
    return Time.from_sec(round(t, 6))


def header(t, frame):
    return Header(stamp=stamp(t), frame_id=frame)


def color(i):
    return bytes(v for y in range(12) for x in range(16) for v in (10 * i + x, 20 + y, 200 - x - i))


def depth(i, width, height, order):
    values = [400 + 10 * i if i == 0 or p == 4 * width + 6 else 0 for p in range(width * height)]
    return struct.pack(f"{order}{len(values)}H", *values)


def png(bits, kind, rows):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    step = len(rows) // 12
    lines = b"".join(b"\0" + rows[y * step:(y + 1) * step] for y in range(12))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", 16, 12, bits, kind, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b""))


def camera_info(t, frame, width, height, f, cx, cy):
    k = [f, 0, cx, 0, f, cy, 0, 0, 1]
    return CameraInfo(header=header(t, frame), width=width, height=height, distortion_model="plumb_bob", D=5 * [0], K=k,
                      R=[1, 0, 0, 0, 1, 0, 0, 0, 1], P=[f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0])


def messages(is_raw):
    def link(parent, child, y, q):
        return TransformStamped(header=header(EPOCH, parent), child_frame_id=child,
                                transform=Transform(translation=Vector3(0, y, 0), rotation=Quaternion(*q)))

    no_turn, optical = (0, 0, 0, 1), (-0.5, 0.5, -0.5, 0.5)
    yield "/tf_static", EPOCH, TFMessage([
        link("camera_link", "camera_depth_optical_frame", 0, optical), link("camera_link", "camera_color_frame", 0.015, no_turn),
        link("camera_color_frame", "camera_color_optical_frame", 0, optical)])
    yield "/chatter", EPOCH, String("hello")
    at_color, at_depth, topic = "camera_color_optical_frame", "camera_depth_optical_frame", "/camera/camera/"
    for i in range(3):
        t = EPOCH + 0.1 * i
        yield topic + "color/camera_info", t, camera_info(t, at_color, 16, 12, 20, 7.5, 5.5)
        if is_raw:
            yield topic + "color/image_raw", t, Image(header=header(t, at_color), width=16, height=12, encoding="rgb8",
                                                      step=48, data=color(i))
            yield topic + "depth/camera_info", t, camera_info(t, at_depth, 12, 9, 10, 5.5, 4)
            yield topic + "depth/image_rect_raw", t, Image(header=header(t + 0.002, at_depth), width=12, height=9,
                                                           encoding="16UC1", step=24, data=depth(i, 12, 9, "<"))
        else:
            yield topic + "color/image_raw/compressed", t, CompressedImage(
                header=header(t, at_color), format="rgb8; png compressed bgr8", data=png(8, 2, color(i)))
            yield topic + "aligned_depth_to_color/image_raw/compressedDepth", t, CompressedImage(
                header=header(t, at_color), format="16UC1; compressedDepth png",
                data=bytes(12) + png(16, 0, depth(i, 16, 12, ">")))


def write(name, compression, is_raw=False, is_closed=True):
    bag = rosbag.Bag(name, "w", compression=compression, chunk_threshold=2000)
    for topic, t, message in messages(is_raw):
        # Without the definition, which takes kilobytes and which the reader does not need.
        type(message)._full_text = "#"
        bag.write(topic, message, stamp(t + LATE))
    bag.flush()
    if not is_closed:
        shutil.copy(name, name + ".copy")
    bag.close()
    if not is_closed:
        shutil.move(name + ".copy", name)
        os.truncate(name, os.path.getsize(name) - 100)


write("none.bag", "none", is_raw=True)
write("bz2.bag", "bz2")
write("lz4.bag", "lz4")
write("interrupted.bag.active", "none", is_closed=False)
write("interrupted_lz4.bag.active", "lz4", is_closed=False)
