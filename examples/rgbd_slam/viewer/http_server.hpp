// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The server of the viewer's page: HTTP/1.1, GET only, for browsers on this machine.
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
  std::string path;   ///< as sent, without the query
  std::string query;  ///< after the question mark
};

/// The value of `name=` in a query; empty if there is none.
[[nodiscard]] std::optional<std::string_view> query_value(std::string_view query, std::string_view name);

struct http_answer {
  int status = 200;
  std::string type = "text/plain";                         ///< content type
  std::vector<std::shared_ptr<const std::string>> body{};  ///< the parts, one after the other
};

[[nodiscard]] http_answer text_answer(int status, std::string text);

/// Limits of what clients can take. No client can extend a time by sending slowly, nor that of a whole answer by
/// reading slowly.
struct http_limits {
  std::size_t header_bytes = std::size_t{16} << 10U;  ///< of a request
  std::size_t connections = 32;  ///< at a time; another one replaces one between requests, or waits in a bounded queue
  std::chrono::milliseconds silence{2000};  ///< of a connection between requests
  std::chrono::milliseconds request{2000};  ///< from the first byte of a request to the last
  std::chrono::milliseconds sending{5000};  ///< in which a client must read some of an answer
  std::size_t bytes_per_millisecond = 64;   ///< at which it must read a whole answer, after `sending`
  std::chrono::milliseconds closing{500};   ///< in which a client can read the last answer
};

/// Serves 127.0.0.1 on one thread. It rejects requests that name another host (a foreign page whose name resolves to
/// 127.0.0.1), other methods than GET, and ranges. The destructor closes all connections. It waits for no
/// client, and for at most one answer.
class http_server {
 public:
  /// `answer` is called on the server's thread for each accepted request; `failed` if it throws, and the connection is
  /// closed. `headers`: lines that every answer has, each with "\r\n" after it.
  http_server(std::function<http_answer(const http_request&)> answer, std::function<void(std::exception_ptr)> failed,
              std::string headers, const http_limits& limits = {});
  http_server(const http_server&) = delete;
  http_server& operator=(const http_server&) = delete;
  ~http_server();

  /// Starts to listen; `port` 0: any free port. Returns false if the port cannot be used. Throws if there is no thread.
  /// Call it once.
  [[nodiscard]] bool listen(unsigned port);
  [[nodiscard]] unsigned port() const { return port_; }

  static constexpr const char* address = "127.0.0.1";

 private:
  class connection;

  void serve();
  /// Ensures that a place is free, if necessary by closing the connection that has waited longest between requests.
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
