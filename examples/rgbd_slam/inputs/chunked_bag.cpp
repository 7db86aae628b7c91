// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/chunked_bag.hpp"

#include <algorithm>
#include <utility>

#include "inputs/decompression.hpp"

namespace app {

using orbis::errc;
using orbis::fail;
using orbis::result;
using kind = bag_record::kind;

result<void> chunked_bag::open() {
  if (std::uint64_t at = definitions(); at != 0)
    while (auto r = record_at(file_, at)) {
      if (r->what == kind::end || r->next > file_.size()) break;
      if (r->what == kind::topic) define(*r);
      at = r->next;
    }
  bool is_indexed = false;  // the last chunk has an index
  std::uint64_t at = first_record();
  auto r = record_at(file_, at);
  for (; r && r->what != kind::end; r = record_at(file_, at)) {
    const bool is_whole = r->next <= file_.size();
    if (is_whole && r->what == kind::topic) define(*r);
    if (is_whole && r->what == kind::message) add(r->channel, {r->time, at, no_chunk});
    if (r->what == kind::chunk) {
      const auto chunk = static_cast<std::uint32_t>(chunks_.size());
      chunks_.push_back(at);
      is_indexed = is_whole && has_index(r->next);
      if (!is_indexed)
        if (auto listed = list(chunk, r->next < file_.size()); !listed) return listed;
    }
    if (is_whole && r->what == kind::index && is_indexed)
      for (bag_message m : entries(file_.read(r->data, r->size))) {
        m.chunk = static_cast<std::uint32_t>(chunks_.size() - 1);
        add(r->channel, m);
      }
    if (!is_whole) break;
    at = r->next;
  }
  if (!r || r->what != kind::end)
    notes.push_back(where_ + ": the bag is truncated, damaged or was not closed; " + count_messages(topics) +
                    " before byte " + std::to_string(at) + " can be read");
  return {};
}

bool chunked_bag::has_index(std::uint64_t at) {
  bool is_found = false;
  for (auto r = record_at(file_, at); r && r->what == kind::index; r = record_at(file_, at)) {
    if (r->next > file_.size() || !topic_of_channel_.contains(r->channel)) return false;
    is_found = true;
    at = r->next;
  }
  return is_found;
}

void chunked_bag::define(const bag_record& r) {
  const auto [at, is_new] = topic_of_channel_.try_emplace(r.channel, unlisted);
  if (!is_new || !is_listed(r.topic.name, r.topic.type)) return;
  const bag_topic& topic = topic_like(topics, r.topic);  // may move the list
  at->second = static_cast<std::size_t>(&topic - topics.data());
}

void chunked_bag::add(std::uint32_t channel, const bag_message& m) {
  const auto found = topic_of_channel_.find(channel);
  if (found != topic_of_channel_.end() && found->second != unlisted) topics[found->second].messages.push_back(m);
}

result<void> chunked_bag::list(std::uint32_t chunk, bool has_end) {
  const auto opened = open_chunk(chunk);
  if (!opened) return fail(opened.error());
  std::uint64_t at = opened->begin;
  while (auto r = record_at(*opened->source, at)) {
    if (r->next > opened->end) break;
    if (r->what == kind::topic) define(*r);
    if (r->what == kind::message) add(r->channel, {r->time, at - opened->begin, chunk});
    at = r->next;
  }
  if (has_end && (at != opened->end || !opened->is_complete))
    notes.push_back(where_ + ": the chunk at byte " + std::to_string(chunks_[chunk]) +
                    " is damaged; only its first messages can be read");
  return {};
}

result<chunked_bag::opened_chunk> chunked_bag::open_chunk(std::uint32_t chunk) {
  const auto r = record_at(file_, chunks_[chunk]);
  if (!r || r->what != kind::chunk) return fail(errc::unreadable, where_, "the file has changed");
  if (r->compression.empty())  // the messages are read from the file
    return opened_chunk{&file_, r->data, std::min(r->data + r->size, file_.size())};
  if (cache_[1].chunk == chunk) std::swap(cache_[0], cache_[1]);
  if (cache_[0].chunk != chunk) {
    const std::string place = where_ + ": the chunk at byte " + std::to_string(chunks_[chunk]);
    if (r->size > whole_message || r->plain_size > whole_message)
      return fail(errc::unsupported, place, "is larger than 1 GiB");
    if (r->plain_size / 1000 > r->size + (std::size_t{1} << 14U))  // a few kilobytes must not take minutes
      return fail(errc::unsupported, place,
                  "declares " + std::to_string(r->plain_size) + " bytes, over 1000 times more than it contains");
    cache_[1] = {};  // frees memory before more is allocated
    auto plain = decompress(r->compression, file_.read(r->data, r->size), r->plain_size, place);
    if (!plain) return fail(plain.error());
    std::swap(cache_[0], cache_[1]);
    const bool is_complete = plain->is_complete && plain->bytes.size() == r->plain_size;
    cache_[0] = {chunk, byte_source{std::move(plain->bytes)}, is_complete};
  }
  return opened_chunk{&*cache_[0].bytes, 0, cache_[0].bytes->size(), cache_[0].is_complete};
}

result<std::string> chunked_bag::read(const bag_message& m, std::size_t most) {
  opened_chunk in{&file_, 0, file_.size()};
  if (m.chunk != no_chunk) {
    auto opened = open_chunk(m.chunk);
    if (!opened) return fail(opened.error());
    in = *opened;
  }
  const auto r = m.at <= in.end - in.begin ? record_at(*in.source, in.begin + m.at) : std::nullopt;
  if (!r || r->what != kind::message || r->next > in.end)
    return fail(
        errc::malformed, where_,
        "a message is damaged" +
            (m.chunk == no_chunk ? std::string{} : " in the chunk at byte " + std::to_string(chunks_[m.chunk])));
  return in.source->read(r->data, std::min<std::uint64_t>(r->size, most));
}

}  // namespace app
