// SPDX-License-Identifier: BSD-3-Clause
//
// Writes the bags of ROS 2 of this folder; see README.md.
import { execFileSync } from "node:child_process";
import { mkdirSync, renameSync, rmSync, writeFileSync } from "node:fs";
import { McapWriter, TempBuffer } from "@mcap/core";
import definitions from "@foxglove/rosmsg-msgs-common";
import cdr from "@foxglove/rosmsg2-serialization";
import ros1 from "@foxglove/rosmsg-serialization";
import zlib from "node:zlib";

const tool = (name, input, ...args) => execFileSync(name, args, { input, maxBuffer: 1 << 26 });
const compressors = { zstd: (b) => tool("zstd", b, "-c", "-q"), lz4: (b) => tool("lz4", b, "-c", "-q") };

// --- messages -------------------------------------------------------------------------------------------------------

const writers = new Map();
function serialize(version, type, message) {
  const key = `${version} ${type}`;
  if (!writers.has(key)) {
    const all = definitions[version === 1 ? "ros1" : "ros2humble"];
    const parts = [];
    const collect = (name) => {
      if (!all[name] || parts.some((p) => p.name === name)) return;
      parts.push(all[name]);
      for (const field of all[name].definitions) if (field.isComplex) collect(field.type);
    };
    collect(type);
    const { MessageWriter } = version === 1 ? ros1 : cdr;
    writers.set(key, new MessageWriter(parts.map((p, i) => (i === 0 ? { ...p, name: version === 1 ? undefined : p.name } : p))));
  }
  return Buffer.from(writers.get(key).writeMessage(message));
}

const stamp = (version, t) => {
  const sec = Math.floor(t + 1e-9), nanosec = Math.round((t - sec) * 1e9);
  return version === 1 ? { sec, nsec: nanosec } : { sec, nanosec, nsec: nanosec };
};
const header = (version, t, frame_id) => ({ seq: 1, stamp: stamp(version, t), frame_id });

const color = (i, width = 16, height = 12) => {
  const data = Buffer.alloc(width * height * 3);
  for (let y = 0; y < height; ++y)
    for (let x = 0; x < width; ++x) data.set([10 * i + x, 20 + y, 200 - x - i], 3 * (y * width + x));
  return data;
};
/// Frame 0 is a wall at 400 mm; later frames have one pixel, at (6, 4).
const depth = (i, width = 12, height = 9) => {
  const data = Buffer.alloc(width * height * 2);
  for (let p = 0; p < width * height; ++p) if (i === 0 || p === 4 * width + 6) data.writeUInt16LE(400 + 10 * i, 2 * p);
  return data;
};
const png = (width, height, bits, type, rows) => {
  const chunk = (name, data) => {
    const body = Buffer.concat([Buffer.from(name), data]), out = Buffer.alloc(body.length + 8);
    out.writeUInt32BE(data.length);
    body.copy(out, 4);
    out.writeUInt32BE(crc32(body), body.length + 4);
    return out;
  };
  const size = Buffer.alloc(13);
  size.writeUInt32BE(width);
  size.writeUInt32BE(height, 4);
  size.set([bits, type, 0, 0, 0], 8);
  const step = rows.length / height;
  const lines = Buffer.concat([...Array(height).keys()].flatMap((y) => [Buffer.from([0]), rows.subarray(y * step, (y + 1) * step)]));
  return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), chunk("IHDR", size), chunk("IDAT", zlib.deflateSync(lines)), chunk("IEND", Buffer.alloc(0))]);
};
function crc32(bytes) {
  let c = ~0;
  for (const b of bytes) {
    c ^= b;
    for (let k = 0; k < 8; ++k) c = (c >>> 1) ^ (c & 1 ? 0xedb88320 : 0);
  }
  return ~c >>> 0;
}

const vector = (x, y, z) => ({ x, y, z });
const quaternion = (x, y, z, w) => ({ x, y, z, w });
const optical = quaternion(-0.5, 0.5, -0.5, 0.5), no_turn = quaternion(0, 0, 0, 1);
const pose = (p, q) => ({ position: p, orientation: q });

/// Messages as [topic, type, recorded time, message], for ROS 1 or 2. All in frames of a RealSense.
function scene(version, { begin, frames = 3, kind = "raw", zero_stamps = false, late = 0.25, tf = true, truth = true }) {
  const out = [];
  const put = (topic, type, t, message) => out.push([topic, type, t + late, message]);
  const image = (topic, t, frame, encoding, width, height, data, extra = {}) =>
    put(topic, "sensor_msgs/Image", t, { header: header(version, zero_stamps ? 0 : t, frame), height, width, encoding, is_bigendian: 0, step: data.length / height, data, ...extra });
  const info = (topic, t, frame, width, height, f, cx, cy, d = [0, 0, 0, 0, 0], model = "plumb_bob") => {
    const k = [f, 0, cx, 0, f, cy, 0, 0, 1], r = [1, 0, 0, 0, 1, 0, 0, 0, 1], p = [f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0];
    put(topic, "sensor_msgs/CameraInfo", t, {
      header: header(version, t, frame), height, width, distortion_model: model,
      D: d, K: k, R: r, P: p, d, k, r, p, binning_x: 0, binning_y: 0,
      roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false },
    });
  };
  const transform = (topic, t, ...links) =>
    put(topic, "tf2_msgs/TFMessage", t, {
      transforms: links.map(([parent, child, p, q]) => ({ header: header(version, t, parent), child_frame_id: child, transform: { translation: p, rotation: q } })),
    });
  const in_color = kind === "raw" ? "camera_depth_optical_frame" : "camera_color_optical_frame";
  if (tf)
    transform("/tf_static", begin,
      ["camera_link", "camera_depth_frame", vector(0, 0, 0), no_turn],
      ["camera_depth_frame", "camera_depth_optical_frame", vector(0, 0, 0), optical],
      ["camera_link", "camera_color_frame", vector(0, 0.015, 0), no_turn],
      ["camera_color_frame", "camera_color_optical_frame", vector(0, 0, 0), optical],
      ["base_link", "camera_link", vector(0.1, 0, 0.3), no_turn]);
  put("/chatter", "std_msgs/String", begin, { data: "hello" });
  for (let i = 0; i < frames; ++i) {
    const t = begin + 0.1 * i;
    info("/camera/camera/color/camera_info", t, "camera_color_optical_frame", 16, 12, 20, 7.5, 5.5);
    if (kind === "compressed") {
      put("/camera/camera/color/image_raw/compressed", "sensor_msgs/CompressedImage", t, { header: header(version, t, "camera_color_optical_frame"), format: "rgb8; png compressed bgr8", data: png(16, 12, 8, 2, color(i)) });
      const big = Buffer.from(depth(i, 16, 12)).swap16();
      put("/camera/camera/aligned_depth_to_color/image_raw/compressedDepth", "sensor_msgs/CompressedImage", t, { header: header(version, t, in_color), format: "16UC1; compressedDepth png", data: Buffer.concat([Buffer.alloc(12), png(16, 12, 16, 0, big)]) });
    } else {
      image("/camera/camera/color/image_raw", t, "camera_color_optical_frame", "rgb8", 16, 12, color(i));
      if (kind === "raw") {
        info("/camera/camera/depth/camera_info", t, in_color, 12, 9, 10, 5.5, 4);
        image("/camera/camera/depth/image_rect_raw", t + 0.002, in_color, "16UC1", 12, 9, depth(i));
      } else {
        const metres = Buffer.alloc(16 * 12 * 4);
        const mm = depth(i, 16, 12);
        for (let p = 0; p < 16 * 12; ++p) metres.writeFloatLE(mm.readUInt16LE(2 * p) / 1000, 4 * p);
        image("/camera/camera/depth_registered/image_rect", t + 0.002, in_color, "32FC1", 16, 12, metres);
      }
    }
    if (truth) {
      // The robot moves along x of the map by 1 m/s; odom is turned by 90 degrees in it.
      transform("/tf", t, ["odom", "base_link", vector(0, -0.1 * i, 0), no_turn]);
      transform("/tf", t, ["map", "odom", vector(0, 0, 0), quaternion(0, 0, Math.SQRT1_2, Math.SQRT1_2)]);
      put("/odom", "nav_msgs/Odometry", t, {
        header: header(version, t, "map"), child_frame_id: "base_link",
        pose: { pose: pose(vector(0.1 * i, 0, 0), no_turn), covariance: Array(36).fill(0) },
        twist: { twist: { linear: vector(1, 0, 0), angular: vector(0, 0, 0) }, covariance: Array(36).fill(0) },
      });
      put("/mocap/pose", "geometry_msgs/PoseStamped", t, { header: header(version, t, "mocap"), pose: pose(vector(0, 0.1 * i, 1), no_turn) });
    }
  }
  return out.map(([topic, type, t, message]) => ({ topic, type, t, data: serialize(version, type, message) }));
}

/// Two cameras whose CameraInfo has no baseline: their frames are 0.25 m apart.
function stereo() {
  const version = 2, out = [];
  const put = (topic, type, t, message) => out.push({ topic, type, t, data: serialize(version, type, message) });
  put("/tf_static", "tf2_msgs/TFMessage", 1, {
    transforms: [{ header: header(version, 1, "left_optical"), child_frame_id: "right_optical", transform: { translation: vector(0.25, 0, 0), rotation: no_turn } }],
  });
  const k = [20, 0, 7.5, 0, 20, 5.5, 0, 0, 1], r = [1, 0, 0, 0, 1, 0, 0, 0, 1], p = [20, 0, 7.5, 0, 0, 20, 5.5, 0, 0, 0, 1, 0];
  for (let i = 0; i < 3; ++i)
    for (const [side, encoding, bytes] of [["left", "mono8", 1], ["right", "yuv422_yuy2", 2]]) {
      const common = { header: header(version, 1 + 0.1 * i, side + "_optical"), height: 12, width: 16 };
      put(`/stereo/${side}/camera_info`, "sensor_msgs/CameraInfo", 1, {
        ...common, distortion_model: "plumb_bob", d: [0, 0, 0, 0, 0], k, r, p, binning_x: 0, binning_y: 0,
        roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false },
      });
      put(`/stereo/${side}/image_raw`, "sensor_msgs/Image", 1, { ...common, encoding, is_bigendian: 0, step: 16 * bytes, data: Buffer.alloc(16 * 12 * bytes, 126) });
    }
  return out;
}

// --- containers -----------------------------------------------------------------------------------------------------

const ros2_type = (type) => type.replace("/", "/msg/");

async function write_mcap(name, messages, { compression = "none", version = 2, ...options } = {}) {
  const file = new TempBuffer();
  const writer = new McapWriter({
    writable: file, chunkSize: 2000,
    compressChunk: compression === "none" ? undefined : (b) => ({ compression, compressedData: compressors[compression](b) }), ...options,
  });
  await writer.start({ profile: version === 1 ? "ros1" : "ros2", library: "" });
  const channels = new Map();
  for (const m of messages) {
    if (!channels.has(m.topic)) {
      const schemaId = await writer.registerSchema({ name: version === 1 ? m.type : ros2_type(m.type), encoding: version === 1 ? "ros1msg" : "ros2msg", data: new Uint8Array() });
      channels.set(m.topic, await writer.registerChannel({ topic: m.topic, schemaId, messageEncoding: version === 1 ? "ros1" : "cdr", metadata: new Map() }));
    }
    const logTime = BigInt(Math.round(m.t * 1e6)) * 1000n;
    await writer.addMessage({ channelId: channels.get(m.topic), sequence: 0, logTime, publishTime: logTime, data: m.data });
  }
  await writer.end();
  writeFileSync(name, file.get());
}

function write_sqlite(name, messages, { compress = false, before = "PRAGMA page_size = 512;" } = {}) {
  for (const ending of ["", "-wal", "-shm"]) rmSync(name + ending, { force: true });
  const topics = [...new Map(messages.map((m) => [m.topic, m.type])).entries()];
  const sql = [
    before,
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);",
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);",
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);",
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
    ...topics.map(([topic, type], i) => `INSERT INTO topics VALUES (${i + 1}, '${topic}', '${ros2_type(type)}', 'cdr', '');`),
    ...messages.map((m) => {
      const data = compress ? compressors.zstd(m.data) : m.data;
      const id = 1 + topics.findIndex(([topic]) => topic === m.topic);
      return `INSERT INTO messages(topic_id, timestamp, data) VALUES (${id}, ${BigInt(Math.round(m.t * 1e6)) * 1000n}, X'${data.toString("hex")}');`;
    }),
  ];
  tool("sqlite3", sql.join("\n"), name);
}

// --- the bags -------------------------------------------------------------------------------------------------------

const epoch = 1700000000;
await write_mcap("realsense_zstd.mcap", scene(2, { begin: epoch }), { compression: "zstd" });
await write_mcap("no_index_lz4.mcap", scene(2, { begin: 0, kind: "registered", tf: false, truth: false }), {
  compression: "lz4", useStatistics: false, useSummaryOffsets: false, repeatSchemas: false, repeatChannels: false, useMessageIndex: false, useChunkIndex: false,
});
await write_mcap("no_chunks.mcap", scene(2, { begin: 100, kind: "compressed", truth: false }), { useChunks: false });
await write_mcap("ros1.mcap", scene(1, { begin: 5, kind: "compressed", truth: false }), { version: 1 });
await write_mcap("no_tf.mcap", scene(2, { begin: epoch, tf: false, truth: false }), { compression: "zstd" });
await write_mcap("no_stamps.mcap", scene(2, { begin: 50, kind: "registered", tf: false, truth: false, zero_stamps: true }), { compression: "zstd" });
await write_mcap("stereo.mcap", stereo(), { compression: "zstd" });

mkdirSync("split", { recursive: true });
const two = scene(2, { begin: epoch, frames: 4, kind: "compressed", truth: false });
const half = two.findIndex((m) => m.t >= epoch + 0.2 + 0.25);
write_sqlite("split/split_0.db3", two.slice(0, half));
write_sqlite("split/split_1.db3", two.slice(half));
writeFileSync("split/metadata.yaml", [
  "rosbag2_bagfile_information:", "  version: 5", "  storage_identifier: sqlite3", "  duration:", "    nanoseconds: 300000000",
  "  relative_file_paths:", "    - split_0.db3", "    - split_1.db3", "  compression_format: \"\"", "  compression_mode: \"\"", ""].join("\n"));
write_sqlite("messages_zstd.db3", scene(2, { begin: epoch, kind: "compressed", tf: false, truth: false }), { compress: true });
// Interrupted while the last messages are in the write-ahead log only: the shell is killed before it moves them.
const log = scene(2, { begin: epoch, kind: "compressed", tf: false, truth: false });
const last = log.findIndex((m) => m.t >= epoch + 0.2 + 0.25);
mkdirSync("wal", { recursive: true });
rmSync("wal/wal.db3-wal", { force: true });
write_sqlite("wal/wal.db3", log.slice(0, last), { before: "PRAGMA page_size = 512; PRAGMA journal_mode = WAL;" });
const rest = log.slice(last).map((m) => `INSERT INTO messages(topic_id, timestamp, data) SELECT id, ${BigInt(Math.round(m.t * 1e6)) * 1000n}, X'${m.data.toString("hex")}' FROM topics WHERE name = '${m.topic}';`);
execFileSync("sh", ["-c", "sqlite3 wal/wal.db3"], { input: [...rest, ".shell cp wal/wal.db3-wal wal/log; cp wal/wal.db3 wal/kept"].join("\n") });
renameSync("wal/kept", "wal/wal.db3");
renameSync("wal/log", "wal/wal.db3-wal");
