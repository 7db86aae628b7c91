// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The server for the viewer's page: HTTP/1.1, GET only, for browsers on this machine.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace app {

struct http_request {
  std::string path;   ///< path as sent, without the query
  std::string query;  ///< text after the question mark
};

/// The value of `name=` in a query; empty if there is none.
[[nodiscard]] std::optional<std::string_view> query_value(std::string_view query, std::string_view name);

struct http_answer {
  int status = 200;
  std::string type = "text/plain";                         ///< content type
  std::vector<std::shared_ptr<const std::string>> body{};  ///< parts, which are sent in order
};

[[nodiscard]] http_answer text_answer(int status, std::string text);

/// Limits on the resources that clients can use. A client that sends slowly extends no time limit, and a client that
/// reads slowly does not extend the time limit for a whole response.
struct http_limits {
  std::size_t header_bytes = std::size_t{16} << 10U;  ///< maximum size of a request
  std::size_t connections = 32;                       ///< maximum number; one more replaces an idle connection or waits
  std::chrono::milliseconds silence{2000};            ///< maximum time between requests on a connection
  std::chrono::milliseconds request{2000};            ///< maximum time from the first byte of a request to the last
  std::chrono::milliseconds sending{5000};            ///< time within which a client must read some part of a response
  std::size_t bytes_per_millisecond = 64;  ///< minimum rate at which a client must read after the time `sending`
  std::chrono::milliseconds closing{500};  ///< time for a client to read the last response
};

/// An HTTP server on 127.0.0.1 with one thread. It rejects requests whose Host header names another host (a page of
/// another site whose name resolves to 127.0.0.1), methods other than GET, and range requests. The destructor closes
/// all connections; it waits for the computation of at most one response, and never for clients.
class http_server {
 public:
  /// `answer` is called on the server's thread for each accepted request; if it throws, `failed` is called and the
  /// connection is closed. `headers`: header lines of every response, each followed by "\r\n".
  http_server(std::function<http_answer(const http_request&)> answer, std::function<void(std::exception_ptr)> failed,
              std::string headers, const http_limits& limits = {});
  http_server(const http_server&) = delete;
  http_server& operator=(const http_server&) = delete;
  ~http_server();

  /// Starts to listen; `port` 0: any free port. Returns false if the port cannot be used. Throws if no thread can be
  /// created. Call it once.
  [[nodiscard]] bool listen(unsigned port);
  [[nodiscard]] unsigned port() const { return port_; }

  static constexpr const char* address = "127.0.0.1";

 private:
  class connection;

  void serve();
  /// If all connections are in use, closes the one that has been idle between requests for the longest time.
  bool make_room(std::vector<std::unique_ptr<connection>>& open) const;
  void accept_one(std::vector<std::unique_ptr<connection>>& open);

  const std::function<http_answer(const http_request&)> answer_;
  const std::function<void(std::exception_ptr)> failed_;
  const std::string headers_;
  const http_limits limits_;
  unsigned port_ = 0;
  int listener_ = -1;
  int wake_[2] = {-1, -1};  // a pipe, closed at the end
  std::atomic<bool> ends_{false};
  std::chrono::steady_clock::time_point accepts_again_{};
  std::thread thread_;
};

}  // namespace app
