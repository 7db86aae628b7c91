// error: bag_score
// A score says how its bags are to be scaled.
#include <orbis/places/keyframe_database.hpp>

struct no_norm {
  double operator()(const orbis::places::bag_of_words&, const orbis::places::bag_of_words&) const { return 0.0; }
};
orbis::places::basic_keyframe_database<int, no_norm> refused;
