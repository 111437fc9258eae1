#include "tuning/search.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace cutproof::tuning {

std::vector<int32_t> substeps_to_try(int32_t given, int32_t most) {
  std::vector<int32_t> substeps = {given};
  for (int32_t s = 1; s <= most; s *= 2) {
    substeps.push_back(s);
    if (s > 1 && s <= most / 3 * 2) substeps.push_back(s + s / 2);
  }
  std::sort(substeps.begin(), substeps.end());
  substeps.erase(std::unique(substeps.begin(), substeps.end()), substeps.end());
  return substeps;
}

namespace {

class Searcher {
 public:
  Searcher(const SearchSpace& space, const Measure& measure) : space_(space), measure_(measure) {}

  // The index of the configuration's trial. An earlier trial counts if it was completed, or given up as too expensive:
  // limits only fall.
  std::size_t attempt(const Configuration& configuration) {
    for (std::size_t t = 0; t < trials_.size(); ++t) {
      if (trials_[t].configuration == configuration) return t;
    }
    std::optional<double> limit;
    if (cheapest_) limit = trials_[*cheapest_].frame.median;
    trials_.push_back(measure_(configuration, limit));
    const Trial& trial = trials_.back();
    const std::size_t index = trials_.size() - 1;
    if (trial.outcome == Outcome::within && (!limit || trial.frame.median < (1 - kCheaper) * *limit)) {
      cheapest_ = index;
    }
    return index;
  }

  // The least number of iterations up to `most` with which `configuration` is within the tolerance; null: none.
  std::optional<int32_t> least_iterations(Configuration configuration, int32_t from, int32_t most) {
    int32_t& iterations = configuration.scene.step.iterations;
    int32_t below = from - 1;  // the most that are not enough
    std::optional<int32_t> enough;
    std::optional<std::size_t> before;
    for (iterations = from; !enough; iterations = std::min(2 * iterations, most)) {
      const std::size_t now = attempt(configuration);
      if (trials_[now].outcome == Outcome::within) {
        enough = iterations;
        break;
      }
      below = iterations;
      const Trial& trial = trials_[now];
      const bool whatever_the_iterations = trial.outcome == Outcome::more_expensive ||
                                           trial.outcome == Outcome::schedule || trial.outcome == Outcome::refused;
      if (whatever_the_iterations || iterations >= most) return std::nullopt;
      if (before && !helps(trials_[*before], trial)) return std::nullopt;
      before = now;
    }
    while (*enough - below > 1) {
      iterations = below + (*enough - below) / 2;
      (trials_[attempt(configuration)].outcome == Outcome::within ? *enough : below) = iterations;
    }
    return enough;
  }

  void search_steps(const Configuration& given) {
    for (const int32_t substeps : space_.substeps) {
      Configuration configuration = given;
      configuration.scene.step.substeps = substeps;
      configuration.scene.step.acceleration = Acceleration::none;
      const std::optional<int32_t> plain = least_iterations(configuration, 1, space_.most_iterations);
      // The first iteration is plain, so acceleration needs at least two. It pays only with fewer than the plain ones.
      const int32_t most = plain ? *plain - 1 : space_.most_iterations;
      if (most < 2) continue;
      configuration.scene.step.acceleration = Acceleration::chebyshev;
      least_iterations(configuration, 2, most);
    }
  }

  void follow_down(const Configuration& given, double error) {
    for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
      Configuration configuration = given;
      configuration.scene.step.acceleration = acceleration;
      for (const int32_t iterations : substeps_to_try(1, space_.most_iterations)) {
        if (acceleration == Acceleration::chebyshev && iterations < 2) continue;  // the first is plain
        configuration.scene.step.iterations = iterations;
        const Trial& trial = trials_[attempt(configuration)];
        if (trial.outcome == Outcome::refused || trial.outcome == Outcome::schedule) break;
        if (trial.outcome != Outcome::topology && trial.greatest_rms_h <= error) break;
      }
    }
  }

  bool vary() {
    if (!cheapest_) return false;
    bool kept = false;
    const auto attempt_with = [&](const std::function<bool(Configuration&)>& change) {
      Configuration configuration = trials_[*cheapest_].configuration;
      if (!change(configuration)) return false;
      const std::size_t before = *cheapest_;
      attempt(configuration);
      kept = kept || *cheapest_ != before;
      return *cheapest_ != before;
    };
    const auto set = [](auto& field, auto value) {
      const bool changes = field != value;
      field = value;
      return changes;
    };
    if (space_.may_drop_skin) attempt_with([&](Configuration& c) { return set(c.scene.skin.wanted, false); });
    if (space_.nothing_removed) {
      attempt_with([&](Configuration& c) {
        if (c.scene.blade || !c.scene.detect.without_blade || c.scene.detect.criterion == Criterion::none) return false;
        remove_nothing(c.scene.detect);
        return true;
      });
    }
    // Larger clusters as long as they pay, else smaller ones.
    const auto resize = [&](bool larger) {
      return attempt_with([&](Configuration& c) {
        ClusterSpec& clusters = c.scene.clusters;
        if (clusters.method != Cooking::sampled) {
          return set(clusters.side, std::max<int32_t>(1, clusters.side + (larger ? 1 : -1)));
        }
        const double factor = larger ? 1.25 : 0.8;
        clusters.spacing *= factor;
        clusters.radius *= factor;
        return true;
      });
    };
    if (space_.may_resize) {
      bool larger = false;
      while (resize(true)) larger = true;
      while (!larger && resize(false)) {
      }
    }
    for (const int32_t debris : {0, 2, 8}) {
      attempt_with([&](Configuration& c) { return set(c.scene.split.debris, debris); });
    }
    return kept;
  }

  std::vector<Trial> run(const Configuration& given) {
    attempt(given);
    search_steps(given);
    if (vary()) least_iterations(trials_[*cheapest_].configuration, 1, space_.most_iterations);
    if (space_.followed_to) follow_down(given, *space_.followed_to);
    return std::move(trials_);
  }

 private:
  static bool helps(const Trial& fewer, const Trial& more) {
    if (!fewer.first_beyond) return true;  // the error was not the reason
    const std::size_t frame = *fewer.first_beyond;
    return more.rms_h.size() > frame && more.rms_h[frame] < (1 - kHelps) * fewer.rms_h[frame];
  }

  const SearchSpace& space_;
  const Measure& measure_;
  std::vector<Trial> trials_;
  std::optional<std::size_t> cheapest_;
};

}  // namespace

std::vector<Trial> search(const Configuration& given, const SearchSpace& space, const Measure& measure) {
  return Searcher(space, measure).run(given);
}

std::vector<std::size_t> by_cost(const std::vector<Trial>& trials) {
  std::vector<std::size_t> left, order;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    if (trials[t].outcome == Outcome::within) left.push_back(t);
  }
  const auto cost = [&](std::size_t t) { return trials[t].frame.median; };
  while (!left.empty()) {
    const double least = cost(
        *std::min_element(left.begin(), left.end(), [&](std::size_t a, std::size_t b) { return cost(a) < cost(b); }));
    const auto next =
        std::find_if(left.begin(), left.end(), [&](std::size_t t) { return (1 - kCheaper) * cost(t) <= least; });
    order.push_back(*next);
    left.erase(next);
  }
  return order;
}

namespace {

// Only these are compared (trial.h).
bool is_comparable(const Trial& trial) { return trial.outcome == Outcome::within || trial.outcome == Outcome::over; }

}  // namespace

bool is_behind(const Trial& trial, double seconds, const std::vector<Trial>& trials, double asked) {
  if (!is_comparable(trial) || !(trial.greatest_rms_h <= std::max(asked, kFrontTolerances.front()))) return true;
  return std::any_of(trials.begin(), trials.end(), [&](const Trial& other) {
    return is_comparable(other) && other.frame.count > 0 && other.greatest_rms_h <= trial.greatest_rms_h &&
           kClearly * other.frame.median < seconds;
  });
}

std::vector<std::size_t> may_be_points(const std::vector<Trial>& trials, double asked) {
  std::vector<std::size_t> points;
  for (std::size_t k = 0; k < trials.size(); ++k) {
    const benchmarks::Times& times = trials[k].frame;
    if (times.count > 0 && (k == 0 || !is_behind(trials[k], times.min, trials, asked))) points.push_back(k);
  }
  return points;
}

std::vector<FrontPoint> front(const std::vector<Trial>& trials, double asked, bool all, double known) {
  std::vector<double> tolerances = {asked};
  for (const double tolerance : kFrontTolerances) {
    if (tolerance != asked && (all || tolerance < asked)) tolerances.push_back(tolerance);
  }
  std::sort(tolerances.begin(), tolerances.end(), std::greater());
  std::vector<FrontPoint> points;
  for (const double tolerance : tolerances) {
    FrontPoint point = {tolerance, {}};
    for (std::size_t k = 0; k < trials.size(); ++k) {
      const Trial& trial = trials[k];
      if (!is_comparable(trial) || trial.frame.count == 0 || !(trial.greatest_rms_h + known <= tolerance)) continue;
      if (!point.trial || trial.frame.median < trials[*point.trial].frame.median) point.trial = k;
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace cutproof::tuning
