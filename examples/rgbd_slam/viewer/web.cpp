// SPDX-License-Identifier: BSD-3-Clause
//
// The scene in a browser: a read-only server on 127.0.0.1 with one page and its data.
#include <atomic>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "viewer/backend.hpp"
#include "viewer/bounded_threads.hpp"
#include "viewer/viewer_page.hpp"
#include "viewer/web_messages.hpp"

// After Eigen, which uses a name (_res) that resolv.h, included here, defines as a macro.
#include <httplib.h>

namespace app {
namespace {

constexpr std::size_t server_threads = 8;
constexpr std::size_t waiting_connections = 8;
constexpr std::size_t requests_per_connection = 20;  // then other connections get a thread

/// Returns true if the Host of a request is this machine. A foreign page whose name resolves to 127.0.0.1 (DNS
/// rebinding) sends that name. The port may differ, as with a tunnel.
bool is_local(const httplib::Request& request) {
  if (request.get_header_value_count("Host") != 1) return false;
  std::string host = request.get_header_value("Host");
  if (const std::size_t colon = host.rfind(':'); colon != std::string::npos) {
    if (host.find_first_not_of("0123456789", colon + 1) != std::string::npos) return false;
    host.resize(colon);
  }
  return host == "127.0.0.1" || host == "localhost";
}

/// The number after `since=`; 0 without it, empty if it is not a number.
std::optional<std::uint64_t> since_of(const httplib::Request& request) {
  if (!request.has_param("since")) return 0;
  const std::string text = request.get_param_value("since");
  std::uint64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class web_backend final : public viewer_backend {
 public:
  web_backend() : session_{std::random_device{}() & 0x7fffffffU} { set_up(); }
  web_backend(const web_backend&) = delete;
  web_backend& operator=(const web_backend&) = delete;
  ~web_backend() override {
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }

  [[nodiscard]] bool listen(unsigned port) {
    if (port == 0) {
      const int found = server_.bind_to_any_port(address);
      if (found <= 0) return false;
      port_ = static_cast<unsigned>(found);
    } else {
      if (!server_.bind_to_port(address, static_cast<int>(port))) return false;
      port_ = port;
    }
    thread_ = std::thread{[this] { serve(); }};
    while (!server_.is_running() && !has_ended_)  // `stop` has no effect before that
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    return true;
  }

  [[nodiscard]] bool draw(const viewer_scene& scene) override;
  [[nodiscard]] std::string where() const override {
    return "http://" + std::string{address} + ":" + std::to_string(port_) + "/";
  }
  [[nodiscard]] std::chrono::milliseconds interval() const override { return std::chrono::milliseconds{50}; }

 private:
  using bytes = std::shared_ptr<const std::string>;
  /// A frame whose image is compressed to JPEG once, on request.
  struct published_frame {
    shown_frame frame;
    std::once_flag once;
    std::string features_and_jpeg;
  };
  struct published_block {
    std::uint64_t revision;
    bytes message;
  };
  static constexpr const char* address = "127.0.0.1";

  void set_up();
  void serve() {
    try {
      if (!server_.listen_after_bind())
        throw std::runtime_error{"the viewer's server does not accept any more connections"};
    } catch (...) {
      note(std::current_exception());
    }
    has_ended_ = true;
  }
  /// Stores the first exception of a server thread for `draw`.
  void note(std::exception_ptr failure) {
    const std::lock_guard lock{mutex_};
    if (!failure_) failure_ = std::move(failure);
  }
  void give_frame(std::uint64_t since, httplib::Response& response);
  void give_graph(std::uint64_t since, httplib::Response& response);
  void give_voxels(std::uint64_t since, httplib::Response& response);

  const std::uint64_t session_;
  unsigned port_ = 0;
  httplib::Server server_;
  std::thread thread_;
  std::atomic<bool> has_ended_{false};

  std::mutex mutex_;  // guards the members below
  std::exception_ptr failure_;
  std::string state_ = "{}";
  std::shared_ptr<published_frame> frame_;
  bytes graph_ = std::make_shared<const std::string>();
  std::uint64_t graph_revision_ = 0;
  shown_voxels voxels_;  // without its blocks
  std::map<block_index, published_block> blocks_;
};

void web_backend::set_up() {
  server_.new_task_queue = [this] {
    return new bounded_threads<httplib::TaskQueue>{server_threads, waiting_connections,
                                                   [this](std::exception_ptr e) { note(std::move(e)); }};
  };
  // Replaces the library's default, which allows two servers on one port.
  server_.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server_.set_tcp_nodelay(true);
  server_.set_keep_alive_max_count(requests_per_connection);
  server_.set_keep_alive_timeout(2);
  server_.set_read_timeout(2);
  server_.set_write_timeout(5);
  server_.set_payload_max_length(0);
  server_.set_default_headers({{"Cache-Control", "no-store"},
                               {"X-Content-Type-Options", "nosniff"},
                               {"X-Frame-Options", "DENY"},
                               {"Cross-Origin-Resource-Policy", "same-origin"},
                               {"Referrer-Policy", "no-referrer"},
                               {"Content-Security-Policy",
                                "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
                                "connect-src 'self'; img-src blob:; base-uri 'none'; form-action 'none'"}});
  server_.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
    // The library would send all requested ranges together, thousands of times the size of the whole file. The answer
    // has no body, because the library would cut that as well.
    if (request.has_header("Range")) {
      response.status = 416;
      response.set_header("Connection", "close");
      return httplib::Server::HandlerResponse::Handled;
    }
    if (!is_local(request)) {
      response.status = 403;
      response.set_header("Connection", "close");
      response.set_content("only for this machine\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    }
    if (request.method != "GET") {
      response.status = 405;
      response.set_header("Allow", "GET");
      response.set_header("Connection", "close");  // the body of the request is not read
      response.set_content("only GET\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    }
    return httplib::Server::HandlerResponse::Unhandled;
  });
  server_.Get("/", [](const httplib::Request&, httplib::Response& response) {
    response.set_content(viewer_page, "text/html; charset=utf-8");
  });
  const auto give = [this](const char* path, void (web_backend::*answer)(std::uint64_t, httplib::Response&)) {
    server_.Get(path, [this, answer](const httplib::Request& request, httplib::Response& response) {
      if (const auto since = since_of(request)) return (this->*answer)(*since, response);
      response.status = 400;
      response.set_content("since: not a number\n", "text/plain");
    });
  };
  give("/frame", &web_backend::give_frame);
  give("/graph", &web_backend::give_graph);
  give("/voxels", &web_backend::give_voxels);
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

void web_backend::give_frame(std::uint64_t since, httplib::Response& response) {
  std::string state;
  std::shared_ptr<published_frame> frame;
  {
    const std::lock_guard lock{mutex_};
    state = state_;
    frame = frame_;
  }
  // frames are counted from 1; 0: the client has none
  if (frame && frame->frame.number + 1 == since) frame.reset();
  if (frame)
    std::call_once(frame->once, [&] { frame->features_and_jpeg = frame_message({}, &frame->frame).substr(4); });
  std::string message = frame_message(state, nullptr);
  if (frame) message.replace(message.size() - 4, 4, frame->features_and_jpeg);
  response.set_content(std::move(message), "application/octet-stream");
}

void web_backend::give_graph(std::uint64_t since, httplib::Response& response) {
  bytes graph;
  {
    const std::lock_guard lock{mutex_};
    if (graph_revision_ == since)
      response.status = 204;
    else
      graph = graph_;
  }
  if (graph) response.set_content(*graph, "application/octet-stream");
}

void web_backend::give_voxels(std::uint64_t since, httplib::Response& response) {
  std::string message;
  std::vector<bytes> blocks;
  {
    const std::lock_guard lock{mutex_};
    for (const auto& [index, block] : blocks_)
      if (block.revision > since) blocks.push_back(block.message);
    message = voxel_header(voxels_, blocks.size());
  }
  std::size_t size = message.size();
  for (const bytes& b : blocks) size += b->size();
  message.reserve(size);
  for (const bytes& b : blocks) message += *b;
  response.set_content(std::move(message), "application/octet-stream");
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
