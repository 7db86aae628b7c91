// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include <orbis/places/default_vocabulary-inl.hpp>
#include <orbis/places/train-inl.hpp>
#include <orbis/places/vocabulary-inl.hpp>
#include <orbis/places/vocabulary_file-inl.hpp>

namespace orbis::places {

template class basic_vocabulary<256>;
template vocabulary default_vocabulary<256>();
template std::string vocabulary_bytes(const vocabulary&);
template result<vocabulary> parse_vocabulary<256>(std::span<const std::byte>, const std::string&);
template result<vocabulary> read_vocabulary<256>(const std::filesystem::path&);
template result<void> write_vocabulary(const std::filesystem::path&, const vocabulary&);
template result<vocabulary> detail::train_by(const sequential_policy&, training_data<256>, const training_options&,
                                             const progress&);
template result<vocabulary> detail::train_by(const parallel_policy&, training_data<256>, const training_options&,
                                             const progress&);

}  // namespace orbis::places
