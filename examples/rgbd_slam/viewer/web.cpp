// SPDX-License-Identifier: BSD-3-Clause
//
// Shows the scene in a browser: a read-only server on 127.0.0.1 with one page and its data.
#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <sys/resource.h>

#include "viewer/backend.hpp"
#include "viewer/http_server.hpp"
#include "viewer/viewer_page.hpp"
#include "viewer/web_messages.hpp"

namespace app {
namespace {

/// The number after `since=`; 0 if the parameter is missing, empty if it is not a number.
std::optional<std::uint64_t> parse_since(const http_request& request) {
  const std::string_view text = query_value(request.query, "since").value_or("0");
  std::uint64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Returns limits that leave most of the process's file descriptors to the SLAM run.
http_limits limits() {
  http_limits made;
  if (rlimit files{}; ::getrlimit(RLIMIT_NOFILE, &files) == 0)
    made.connections = std::clamp<std::size_t>(files.rlim_cur / 8, 1, made.connections);
  return made;
}

class web_backend final : public viewer_backend {
 public:
  web_backend()
      : session_{std::random_device{}() & 0x7fffffffU},
        server_{[this](const http_request& request) { return answer(request); },
                [this](std::exception_ptr e) { note(std::move(e)); },
                "Cache-Control: no-store\r\n"
                "X-Content-Type-Options: nosniff\r\n"
                "X-Frame-Options: DENY\r\n"
                "Cross-Origin-Resource-Policy: same-origin\r\n"
                "Referrer-Policy: no-referrer\r\n"
                "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
                "connect-src 'self'; img-src blob:; base-uri 'none'; form-action 'none'\r\n",
                limits()} {}
  web_backend(const web_backend&) = delete;
  web_backend& operator=(const web_backend&) = delete;

  [[nodiscard]] bool listen(unsigned port) { return server_.listen(port); }

  [[nodiscard]] bool draw(const viewer_scene& scene) override;
  [[nodiscard]] std::string where() const override {
    return "http://" + std::string{http_server::address} + ":" + std::to_string(server_.port()) + "/";
  }
  [[nodiscard]] std::chrono::milliseconds interval() const override { return std::chrono::milliseconds{50}; }

 private:
  using bytes = std::shared_ptr<const std::string>;
  /// A frame whose image is compressed to JPEG once.
  struct published_frame {
    shown_frame frame;
    bytes features_and_jpeg;  // created on request; used only by the server's thread
  };
  struct published_block {
    std::uint64_t revision;
    bytes message;
  };

  [[nodiscard]] http_answer answer(const http_request& request);
  /// Stores the first exception thrown in the server's thread; `draw` rethrows it.
  void note(std::exception_ptr failure) {
    const std::lock_guard lock{mutex_};
    if (!failure_) failure_ = std::move(failure);
  }
  [[nodiscard]] http_answer frame_since(std::uint64_t since);
  [[nodiscard]] http_answer graph_since(std::uint64_t since);
  [[nodiscard]] http_answer voxels_since(std::uint64_t since);

  static constexpr const char* binary = "application/octet-stream";
  const std::uint64_t session_;
  const bytes page_ = std::make_shared<const std::string>(viewer_page);

  std::mutex mutex_;  // guards the members below
  std::exception_ptr failure_;
  std::string state_ = "{}";
  std::shared_ptr<published_frame> frame_;
  bytes graph_ = std::make_shared<const std::string>();
  std::uint64_t graph_revision_ = 0;
  shown_voxels voxels_;  // without the blocks
  std::map<block_index, published_block> blocks_;
  http_server server_;  // last member: its thread uses the others
};

http_answer web_backend::answer(const http_request& request) {
  const std::string& path = request.path;
  if (path == "/") return {.type = "text/html; charset=utf-8", .body = {page_}};
  if (path != "/frame" && path != "/graph" && path != "/voxels") return text_answer(404, "no such page\n");
  const auto since = parse_since(request);
  if (!since) return text_answer(400, "since: not a number\n");
  return path == "/frame" ? frame_since(*since) : path == "/graph" ? graph_since(*since) : voxels_since(*since);
}

bool web_backend::draw(const viewer_scene& scene) {
  std::string state = state_json(scene, session_);
  std::shared_ptr<published_frame> frame;
  bytes graph;
  std::vector<std::pair<block_index, published_block>> blocks;
  // Only this thread changes the compared values, so they can be read without the lock.
  if (scene.frame && (!frame_ || frame_->frame.number != scene.frame->number)) {
    frame = std::make_shared<published_frame>();
    frame->frame = *scene.frame;
  }
  if (scene.graph.revision != graph_revision_) graph = std::make_shared<const std::string>(graph_message(scene.graph));
  if (scene.voxels.revision != voxels_.revision)
    for (const auto& [index, block] : scene.voxels.blocks)
      if (block.revision > voxels_.revision)
        blocks.emplace_back(
            index, published_block{block.revision, std::make_shared<const std::string>(block_message(index, block))});
  const std::lock_guard lock{mutex_};
  if (failure_) std::rethrow_exception(failure_);
  state_ = std::move(state);
  if (frame) frame_.swap(frame);
  if (graph) {
    graph_.swap(graph);
    graph_revision_ = scene.graph.revision;
  }
  voxels_.revision = scene.voxels.revision;
  voxels_.resolution = scene.voxels.resolution;
  voxels_.floor = scene.voxels.floor;
  voxels_.ceiling = scene.voxels.ceiling;
  for (auto& [index, block] : blocks) blocks_.insert_or_assign(index, std::move(block));
  return true;
}

http_answer web_backend::frame_since(std::uint64_t since) {
  std::string state;
  std::shared_ptr<published_frame> frame;
  {
    const std::lock_guard lock{mutex_};
    state = state_;
    frame = frame_;
  }
  // frames are counted from 1; 0: the client has no frame
  if (frame && frame->frame.number + 1 == since) frame.reset();
  if (frame && !frame->features_and_jpeg)
    frame->features_and_jpeg = std::make_shared<const std::string>(frame_message({}, &frame->frame).substr(4));
  std::string message = frame_message(state, nullptr);
  if (frame) message.resize(message.size() - 4);
  http_answer answer{.type = binary, .body = {std::make_shared<const std::string>(std::move(message))}};
  if (frame) answer.body.push_back(frame->features_and_jpeg);
  return answer;
}

http_answer web_backend::graph_since(std::uint64_t since) {
  const std::lock_guard lock{mutex_};
  if (graph_revision_ == since) return {.status = 204};
  return {.type = binary, .body = {graph_}};
}

http_answer web_backend::voxels_since(std::uint64_t since) {
  http_answer answer{.type = binary, .body = {nullptr}};
  const std::lock_guard lock{mutex_};
  for (const auto& [index, block] : blocks_)
    if (block.revision > since) answer.body.push_back(block.message);
  answer.body.front() = std::make_shared<const std::string>(voxel_header(voxels_, answer.body.size() - 1));
  return answer;
}

}  // namespace

orbis::result<std::unique_ptr<viewer_backend>> open_web(unsigned port) {
  auto server = std::make_unique<web_backend>();
  if (!server->listen(port))
    return orbis::fail(
        orbis::errc::unreadable, "127.0.0.1:" + std::to_string(port),
        "the viewer cannot use this port; choose another one with --viewer-port, or 0 for any free port");
  return server;
}

}  // namespace app
