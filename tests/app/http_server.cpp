// SPDX-License-Identifier: BSD-3-Clause
//
// The page's server against clients that try to keep it busy.
#include "viewer/http_server.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "support/catch.hpp"

using namespace app;

namespace {

using clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// A connection that sends and reads what the test wants.
class client {
 public:
  explicit client(unsigned port, int receive_buffer = 0) : socket_{::socket(AF_INET, SOCK_STREAM, 0)} {
    if (receive_buffer != 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<std::uint16_t>(port));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    is_open_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0;
  }
  client(const client&) = delete;
  client& operator=(const client&) = delete;
  ~client() { ::close(socket_); }

  /// Returns false if the other end is closed, or takes nothing for a second.
  bool send(std::string_view text) {
    while (is_open_ && !text.empty()) {
      pollfd ready{socket_, POLLOUT, 0};
      if (::poll(&ready, 1, 1000) <= 0) return false;
      const ssize_t count = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count < 0) return false;
      text.remove_prefix(static_cast<std::size_t>(count));
    }
    return is_open_;
  }
  /// The bytes that arrive until `end` has, the connection is closed, or the time is over.
  std::string receive(std::string_view end, milliseconds most = milliseconds{2000}) {
    const auto until = clock::now() + most;
    std::string all;
    while (end.empty() || all.find(end) == std::string::npos) {
      const auto left = std::chrono::duration_cast<milliseconds>(until - clock::now()).count();
      pollfd ready{socket_, POLLIN, 0};
      std::array<char, 65536> bytes{};
      if (left <= 0 || ::poll(&ready, 1, static_cast<int>(left)) <= 0) break;
      const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
      closed_ = count <= 0;
      if (closed_) break;
      all.append(bytes.data(), static_cast<std::size_t>(count));
    }
    return all;
  }
  [[nodiscard]] bool is_closed() const { return closed_; }

 private:
  int socket_;
  bool is_open_ = false, closed_ = false;
};

constexpr const char* request = "GET /ask HTTP/1.1\r\nHost: localhost\r\n\r\n";

struct served {
  std::atomic<int> failures{0};
  std::string large = std::string(std::size_t{32} << 20U, 'x');
  std::unique_ptr<http_server> server;

  explicit served(const http_limits& limits = {}) {
    server = std::make_unique<http_server>(
        [this](const http_request& r) {
          if (r.path == "/throw") throw std::runtime_error{"no"};
          return text_answer(200, r.path == "/large" ? large : "answer " + r.path + "?" + r.query);
        },
        [this](const std::exception_ptr&) { ++failures; }, "X-Test: 1\r\n", limits);
    if (!server->listen(0)) throw std::runtime_error{"no port"};
  }
  [[nodiscard]] unsigned port() const { return server->port(); }
  /// Returns true if a new client is answered.
  [[nodiscard]] bool answers() const {
    client c{port()};
    return c.send(request) && c.receive("answer /ask?").find("200 OK") != std::string::npos;
  }
  [[nodiscard]] milliseconds time_to_end() {
    const auto start = clock::now();
    server.reset();
    return std::chrono::duration_cast<milliseconds>(clock::now() - start);
  }
};

double megabytes_used() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace

TEST_CASE("The server answers requests one after the other, and all that come at once") {
  served s;
  client c{s.port()};
  REQUIRE(c.send("GET /one?a=1 HTTP/1.1\r\nhost: 127.0.0.1:80\r\n\r\nGET /two HTTP/1.1\nHost: localhost\n\nGET /thr"));
  const std::string first = c.receive("answer /two?");
  CHECK(first.find("answer /one?a=1") < first.find("answer /two?"));
  CHECK(first.find("X-Test: 1\r\n") != std::string::npos);
  CHECK(first.find("Content-Length: 15\r\n") != std::string::npos);
  REQUIRE(c.send("ee HTTP/1.0\r\nHost: localhost\r\n\r\n"));
  CHECK(c.receive("").find("answer /three?") != std::string::npos);
  CHECK(c.is_closed());  // as of version 1.0
}

TEST_CASE("Malformed and foreign requests are refused, and the connection is closed") {
  served s;
  for (const auto& [text, status] :
       {std::pair{"nonsense\r\n\r\n", "400"}, std::pair{"GET ask HTTP/1.1\r\nHost: localhost\r\n\r\n", "400"},
        std::pair{"GET / FTP/1.1\r\nHost: localhost\r\n\r\n", "400"}, std::pair{"GET / HTTP/1.1\r\n\r\n", "403"},
        std::pair{"GET / HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n", "403"},
        std::pair{"GET / HTTP/1.1\r\nHost: example.org\r\n\r\n", "403"},
        std::pair{"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc", "405"},
        std::pair{"GET / HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-\r\n\r\n", "416"}}) {
    INFO(text);
    client c{s.port()};
    REQUIRE(c.send(text));
    CHECK(c.receive("").starts_with("HTTP/1.1 " + std::string{status}));
    CHECK(c.is_closed());
  }
  CHECK(query_value("a=1&since=42&b", "since") == "42");
  CHECK(query_value("b", "b") == "");
  CHECK_FALSE(query_value("a=1", "since"));
}

TEST_CASE("An answer that fails ends its connection only") {
  served s;
  client c{s.port()};
  REQUIRE(c.send("GET /throw HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  c.receive("");
  CHECK(c.is_closed());
  CHECK(s.failures == 1);
  CHECK(s.answers());
}

TEST_CASE("Clients that send a header slowly lose their places") {
  http_limits limits;
  limits.connections = 4;
  limits.request = milliseconds{300};
  served s{limits};
  std::vector<std::unique_ptr<client>> slow;
  for (int i = 0; i != 4; ++i) {
    slow.push_back(std::make_unique<client>(s.port()));
    REQUIRE(slow.back()->send("GET / HTTP/1.1\r\n"));
  }
  std::atomic<bool> ends{false};
  std::thread trickle{[&] {  // a line every 50 ms, for ever
    while (!ends) {
      for (const auto& c : slow) c->send("A: b\r\n");
      std::this_thread::sleep_for(milliseconds{50});
    }
  }};
  CHECK(s.answers());  // after 0.3 s, when all four places are free again
  ends = true;
  trickle.join();
  for (const auto& c : slow) {
    c->receive("", milliseconds{100});
    CHECK(c->is_closed());
  }
}

TEST_CASE("The end of the server waits for no client") {
  const std::string begun = "GET / HTTP/1.1\r\nA: b\r\n";
  const auto how = GENERATE(as<std::string>{}, "silent", "slow", "not reading");
  INFO(how);
  served s;
  std::vector<std::unique_ptr<client>> clients;
  for (int i = 0; i != 48; ++i) {  // more than are served at a time
    clients.push_back(std::make_unique<client>(s.port(), 4096));
    if (how == "slow") clients.back()->send(begun);
    if (how == "not reading") clients.back()->send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  std::this_thread::sleep_for(milliseconds{100});
  CHECK(s.time_to_end().count() < 500);
}

TEST_CASE("The end of the server waits for one answer") {
  constexpr int answers = 16;
  constexpr milliseconds each{30};
  std::atomic<int> answered{0};
  auto server = std::make_unique<http_server>(
      [&](const http_request&) {
        ++answered;
        std::this_thread::sleep_for(each);
        return text_answer(200, "late");
      },
      [](const std::exception_ptr&) {}, "", http_limits{});
  REQUIRE(server->listen(0));
  // Each asks twice before the first answer.
  std::vector<std::unique_ptr<client>> clients;
  for (int i = 0; i != answers; ++i) clients.push_back(std::make_unique<client>(server->port()));
  std::this_thread::sleep_for(milliseconds{50});
  for (const auto& c : clients) REQUIRE(c->send(std::string{request} + request));
  // Then it answers all others, without waiting in between.
  for (int i = 0; i != 1000 && answered < 4; ++i) std::this_thread::sleep_for(milliseconds{1});
  REQUIRE(answered >= 4);
  server.reset();
  CHECK(answered <= answers);  // of twice as many
}

TEST_CASE("An endless header takes no memory") {
  served s;
  const double before = megabytes_used();
  client c{s.port()};
  REQUIRE(c.send("GET / HTTP/1.1\r\nHost: localhost\r\n"));
  const std::string line = "A: " + std::string(4000, 'b') + "\r\n";
  std::size_t sent = 0;
  while (sent < std::size_t{256} << 20U && c.send(line)) sent += line.size();
  CHECK(sent < std::size_t{256} << 20U);
  CHECK(megabytes_used() - before < 16.0);
  client other{s.port()};
  REQUIRE(other.send("GET / HTTP/1.1\r\nA: " + std::string(20000, 'b')));
  CHECK(other.receive("").starts_with("HTTP/1.1 431"));
  CHECK(s.answers());
}

TEST_CASE("A client that does not read its answer loses its place") {
  http_limits limits;
  limits.connections = 1;
  limits.sending = milliseconds{100};
  if (GENERATE(true, false)) limits.bytes_per_millisecond = std::size_t{1} << 20U;  // else the whole may take minutes
  served s{limits};
  client deaf{s.port(), 4096};
  REQUIRE(deaf.send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  std::this_thread::sleep_for(milliseconds{50});
  CHECK(s.answers());
}

TEST_CASE("A new client replaces the one that has waited longest between requests") {
  http_limits limits;
  limits.connections = 2;
  limits.silence = limits.request = milliseconds{60000};
  served s{limits};
  client first{s.port()}, second{s.port()};
  for (client* c : {&first, &second}) {
    REQUIRE(c->send(request));
    c->receive("answer /ask?");
  }
  CHECK(s.answers());
  first.receive("", milliseconds{500});
  CHECK(first.is_closed());
  second.receive("", milliseconds{100});
  CHECK_FALSE(second.is_closed());
  // A begun request keeps its place.
  REQUIRE(second.send("GET /ask HTTP/1.1\r\n"));
  std::this_thread::sleep_for(milliseconds{50});
  CHECK(s.answers());
  CHECK(s.answers());
  REQUIRE(second.send("Host: localhost\r\n\r\n"));
  CHECK(second.receive("answer /ask?").find("200 OK") != std::string::npos);
}
