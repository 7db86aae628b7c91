// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/http_server.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <system_error>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace app {
namespace {

using clock = std::chrono::steady_clock;

#ifdef MSG_NOSIGNAL
constexpr int send_flags = MSG_NOSIGNAL;
#else
constexpr int send_flags = 0;
#endif

const char* reason_phrase(int status) {
  switch (status) {
    case 200: return "OK";
    case 204: return "No Content";
    case 400: return "Bad Request";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 416: return "Range Not Satisfiable";
    case 431: return "Request Header Fields Too Large";
    default: return "Error";
  }
}

bool would_block() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

void make_private(int descriptor) {
  ::fcntl(descriptor, F_SETFD, FD_CLOEXEC);
  ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
}

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

bool is_same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

/// Removes the next part of `text` up to and including `separator`, and returns it without the separator.
std::string_view take(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

/// The header of a request.
struct header {
  std::string_view method, target, version;
  std::string_view host;
  std::size_t hosts = 0;
  bool has_range = false, has_body = false, closes = false;
};

header parse(std::string_view text) {
  header h;
  std::string_view first = trimmed(take(text, '\n'));
  h.method = take(first, ' ');
  h.target = take(first, ' ');
  h.version = first;
  h.closes = h.version != "HTTP/1.1";
  while (!text.empty()) {
    std::string_view value = take(text, '\n');
    const std::string_view name = take(value, ':');
    value = trimmed(value);
    if (is_same_name(name, "Host")) ++h.hosts, h.host = value;
    if (is_same_name(name, "Range")) h.has_range = true;
    if (is_same_name(name, "Content-Length") || is_same_name(name, "Transfer-Encoding")) h.has_body = true;
    if (is_same_name(name, "Connection") && is_same_name(value, "close")) h.closes = true;
  }
  return h;
}

/// Returns true if the host is this machine. The port may differ, for example because of a tunnel.
bool is_local(std::string_view host) {
  if (const std::size_t colon = host.rfind(':'); colon != host.npos) {
    if (host.find_first_not_of("0123456789", colon + 1) != host.npos) return false;
    host = host.substr(0, colon);
  }
  return host == http_server::address || is_same_name(host, "localhost");
}

}  // namespace

std::optional<std::string_view> query_value(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    std::string_view value = take(query, '&');
    if (take(value, '=') == name) return value;
  }
  return std::nullopt;
}

http_answer text_answer(int status, std::string text) {
  return {.status = status, .body = {std::make_shared<const std::string>(std::move(text))}};
}

/// One client.
class http_server::connection {
 public:
  connection(int socket, const http_server& of) : socket_{socket}, of_{of} { wait(of.limits_.silence); }
  connection(const connection&) = delete;
  connection& operator=(const connection&) = delete;
  ~connection() { ::close(socket_); }

  [[nodiscard]] int socket() const { return socket_; }
  [[nodiscard]] short events() const { return state_ == state::sends ? POLLOUT : POLLIN; }
  [[nodiscard]] clock::time_point deadline() const { return deadline_; }
  /// Returns true while no request is being received or answered.
  [[nodiscard]] bool is_idle() const { return state_ == state::reads && received_.empty(); }

  /// Reads or writes as far as possible without waiting. Returns false if the connection ends.
  [[nodiscard]] bool advance() {
    if (state_ == state::sends ? !send() : !receive()) return false;
    while (state_ == state::reads && !of_.ends_) {
      const auto answer = answer_next();
      if (!answer) return true;
      if (!begin(*answer)) return false;
    }
    return true;
  }

 private:
  enum class state { reads, sends, closes };
  static constexpr std::size_t most_ignored = std::size_t{1} << 20U;

  void wait(std::chrono::milliseconds time) { deadline_ = clock::now() + time; }

  bool receive() {
    char bytes[4096];
    const ssize_t count = ::recv(socket_, bytes, sizeof bytes, 0);
    if (count <= 0) return count < 0 && would_block();
    if (state_ == state::closes) {  // data that arrives after the last response is discarded
      ignored_ += static_cast<std::size_t>(count);
      return ignored_ < most_ignored;
    }
    if (received_.empty()) wait(of_.limits_.request);
    received_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }
  /// The response to the first received request; empty if the request is not complete.
  std::optional<http_answer> answer_next() {
    const std::size_t crlf = received_.find("\n\r\n"), lf = received_.find("\n\n");
    const std::size_t end =
        std::min(crlf == std::string::npos ? crlf : crlf + 3, lf == std::string::npos ? lf : lf + 2);
    closes_ = true;
    if (std::min(end, received_.size()) > of_.limits_.header_bytes) return text_answer(431, "the header is too long\n");
    if (end == std::string::npos) return std::nullopt;
    const std::string text = received_.substr(0, end);
    received_.erase(0, end);
    const header h = parse(text);
    // A range that is requested many times could be thousands of times the size of the whole page.
    if (h.has_range) return http_answer{.status = 416};
    if (!h.target.starts_with('/') || !h.version.starts_with("HTTP/1.")) return text_answer(400, "not a request\n");
    if (h.hosts != 1 || !is_local(h.host)) return text_answer(403, "the host is not this machine\n");
    if (h.method != "GET") return text_answer(405, h.method == "HEAD" ? "" : "only GET is supported\n");
    closes_ = h.closes || h.has_body;
    std::string_view rest = h.target;
    const std::string path{take(rest, '?')};
    try {
      return of_.answer_({path, std::string{rest}});
    } catch (...) {
      of_.failed_(std::current_exception());
      closes_ = true;
      return text_answer(500, "");
    }
  }
  bool begin(const http_answer& answer) {
    std::size_t size = 0;
    for (const auto& part : answer.body) size += part->size();
    std::string head =
        "HTTP/1.1 " + std::to_string(answer.status) + " " + reason_phrase(answer.status) + "\r\n" + of_.headers_;
    if (answer.status == 405) head += "Allow: GET\r\n";
    if (answer.status != 204) head += "Content-Length: " + std::to_string(size) + "\r\n";
    if (size != 0) head += "Content-Type: " + answer.type + "\r\n";
    head += closes_ ? "Connection: close\r\n\r\n" : "Connection: keep-alive\r\n\r\n";
    parts_ = {std::make_shared<const std::string>(std::move(head))};
    parts_.insert(parts_.end(), answer.body.begin(), answer.body.end());
    part_ = sent_ = 0;
    state_ = state::sends;
    last_ = clock::now() + of_.limits_.sending + std::chrono::milliseconds{size / of_.limits_.bytes_per_millisecond};
    wait(of_.limits_.sending);
    return send();
  }
  bool send() {
    constexpr std::size_t most_at_once = std::size_t{1} << 20U;  // before serving the other connections
    for (std::size_t all = 0; part_ != parts_.size() && all < most_at_once;) {
      const std::string& part = *parts_[part_];
      const ssize_t count = ::send(socket_, part.data() + sent_, part.size() - sent_, send_flags);
      if (count < 0) return would_block();
      sent_ += static_cast<std::size_t>(count);
      all += static_cast<std::size_t>(count);
      deadline_ = std::min(last_, clock::now() + of_.limits_.sending);
      if (sent_ == part.size()) ++part_, sent_ = 0;
    }
    if (part_ != parts_.size()) return true;
    parts_.clear();
    if (closes_) ::shutdown(socket_, SHUT_WR);  // after a close, unread request bytes would discard the response
    state_ = closes_ ? state::closes : state::reads;
    wait(closes_ ? of_.limits_.closing : received_.empty() ? of_.limits_.silence : of_.limits_.request);
    return true;
  }

  const int socket_;
  const http_server& of_;
  state state_ = state::reads;
  clock::time_point deadline_;
  clock::time_point last_{};  // deadline for the whole response
  std::string received_;      // data of the next requests
  std::vector<std::shared_ptr<const std::string>> parts_;
  std::size_t part_ = 0, sent_ = 0;  // index of the current part, and its bytes sent so far
  bool closes_ = false;              // closes the connection after this response
  std::size_t ignored_ = 0;          // bytes received after the last response
};

http_server::http_server(std::function<http_answer(const http_request&)> answer,
                         std::function<void(std::exception_ptr)> failed, std::string headers, const http_limits& limits)
    : answer_{std::move(answer)}, failed_{std::move(failed)}, headers_{std::move(headers)}, limits_{limits} {}

http_server::~http_server() {
  ends_ = true;
  if (wake_[1] >= 0) ::close(wake_[1]);
  if (thread_.joinable()) thread_.join();
  if (wake_[0] >= 0) ::close(wake_[0]);
  if (listener_ >= 0) ::close(listener_);
}

bool http_server::listen(unsigned port) {
  listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
  if (listener_ < 0) return false;
  make_private(listener_);
  const int yes = 1;
  ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(static_cast<std::uint16_t>(port));
  where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof where;
  if (::bind(listener_, reinterpret_cast<const sockaddr*>(&where), size) != 0 || ::listen(listener_, 16) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&where), &size) != 0)
    return false;
  port_ = ntohs(where.sin_port);
  if (::pipe(wake_) != 0) throw std::system_error{errno, std::generic_category(), "pipe"};
  for (const int end : wake_) make_private(end);
  thread_ = std::thread{[this] {
    try {
      serve();
    } catch (...) {
      failed_(std::current_exception());
    }
  }};
  return true;
}

void http_server::accept_one(std::vector<std::unique_ptr<connection>>& open) {
  const int socket = ::accept(listener_, nullptr, nullptr);
  if (socket < 0) {
    if (!would_block()) accepts_again_ = clock::now() + std::chrono::milliseconds{100};  // out of descriptors or memory
    return;
  }
  std::unique_ptr<connection> made;
  try {
    made = std::make_unique<connection>(socket, *this);
  } catch (...) {
    ::close(socket);
    throw;
  }
  make_private(socket);
  const int yes = 1, buffer = 128 << 10;  // small, so that a slow client's progress is seen often
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  open.push_back(std::move(made));
}

bool http_server::make_room(std::vector<std::unique_ptr<connection>>& open) const {
  if (open.size() < limits_.connections) return true;
  auto oldest = open.end();
  for (auto c = open.begin(); c != open.end(); ++c)
    if ((*c)->is_idle() && (oldest == open.end() || (*c)->deadline() < (*oldest)->deadline())) oldest = c;
  if (oldest == open.end()) return false;
  open.erase(oldest);
  return true;
}

void http_server::serve() {
  std::vector<std::unique_ptr<connection>> open;
  std::vector<pollfd> watched;
  for (;;) {
    const auto now = clock::now();
    const auto is_idle = [](const auto& c) { return c->is_idle(); };
    const bool may_have_room = open.size() < limits_.connections || std::ranges::any_of(open, is_idle);
    const bool accepts = may_have_room && now >= accepts_again_;
    watched.assign({{wake_[0], POLLIN, 0}, {accepts ? listener_ : -1, POLLIN, 0}});
    auto next = accepts ? now + std::chrono::hours{1} : now + std::chrono::milliseconds{100};
    for (const auto& c : open) {
      watched.push_back({c->socket(), c->events(), 0});
      next = std::min(next, c->deadline());
    }
    const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(std::max(next - now, clock::duration{}));
    if (::poll(watched.data(), static_cast<nfds_t>(watched.size()), static_cast<int>(wait.count()) + 1) < 0) {
      if (errno != EINTR) throw std::system_error{errno, std::generic_category(), "poll"};
      continue;
    }
    if (watched[0].revents != 0) return;
    const auto later = clock::now();
    for (std::size_t i = 0; i != open.size(); ++i) {
      if (ends_) return;  // checked here because responses may take a long time
      const bool goes_on = watched[i + 2].revents == 0 || open[i]->advance();
      if (!goes_on || open[i]->deadline() <= later) open[i].reset();
    }
    std::erase(open, nullptr);
    if (watched[1].revents != 0 && make_room(open)) accept_one(open);
  }
}

}  // namespace app
