// error: bit_string
// Numbers with a decimal point are no bits.
#include <array>
#include <vector>

#include <orbis/places/vocabulary.hpp>

void refused(const orbis::places::vocabulary& words, const std::vector<std::array<float, 8>>& descriptors) {
  (void)words.transform(descriptors);
}
