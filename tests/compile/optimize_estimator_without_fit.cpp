// error: model_estimator[<']
// RANSAC says what it needs where an estimator cannot fit.
#include <orbis/optimize/ransac.hpp>

struct incomplete {
  using model = double;
  static constexpr std::size_t sample_size = 1;
  std::size_t size() const { return 0; }
};

void refused() { (void)orbis::optimize::ransac(incomplete{}, {}); }
