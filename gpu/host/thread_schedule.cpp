#include "gpu/host/thread_schedule.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace cutproof::gpu {
namespace {

// SplitMix64 (Steele et al. 2014): the same numbers on every machine, unlike the distributions of <random>.
struct SplitMix {
  std::uint64_t state;
  std::uint64_t operator()() {
    std::uint64_t z = state += 0x9E3779B97F4A7C15ull;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  int below(int bound) { return static_cast<int>(operator()() % static_cast<std::uint64_t>(bound)); }
};

// Built for processors without the instruction, std::popcount calls a function of libgcc.
int count_of(std::uint32_t mask) {
  mask -= mask >> 1 & 0x55555555u;
  mask = (mask & 0x33333333u) + (mask >> 2 & 0x33333333u);
  return static_cast<int>(((mask + (mask >> 4)) & 0x0f0f0f0fu) * 0x01010101u >> 24);
}

// Position of the n-th set bit, n from 0.
int nth_bit(std::uint32_t mask, int n) {
  for (; n > 0; --n) mask &= mask - 1;
  return std::countr_zero(mask);
}

std::uint32_t bits_from(int bit) { return ~0u << bit; }

}  // namespace

int Candidates::count() const {
  int sum = 0;
  for (const std::uint32_t mask : masks) sum += count_of(mask);
  return sum;
}

int Candidates::lowest() const {
  for (std::size_t place = 0; place < masks.size(); ++place) {
    if (masks[place] != 0) return static_cast<int>(place) * 32 + std::countr_zero(masks[place]);
  }
  throw std::logic_error("A schedule was asked to choose from no threads.");
}

int Candidates::highest() const {
  for (std::size_t place = masks.size(); place-- > 0;) {
    if (masks[place] != 0) return static_cast<int>(place) * 32 + 31 - std::countl_zero(masks[place]);
  }
  throw std::logic_error("A schedule was asked to choose from no threads.");
}

int Candidates::nth(int k) const {
  const int places = static_cast<int>(masks.size());
  const int start = current / 32, bit = current % 32;
  for (int step = 0, place = start; step <= places; ++step, place = place + 1 < places ? place + 1 : 0) {
    std::uint32_t mask = masks[place];
    if (step == 0) mask &= bits_from(bit);
    if (step == places) mask &= ~bits_from(bit);
    const int here = count_of(mask);
    if (k < here) return place * 32 + nth_bit(mask, k);
    k -= here;
  }
  throw std::logic_error("A schedule chose a thread that does not exist.");
}

int Candidates::rank(int thread) const {
  const int places = static_cast<int>(masks.size());
  const auto before = [&](int bound) {  // candidates with a smaller number
    int sum = 0;
    for (int place = 0; place < bound / 32; ++place) sum += count_of(masks[place]);
    if (bound / 32 < places) sum += count_of(masks[bound / 32] & ~bits_from(bound % 32));
    return sum;
  };
  const int difference = before(thread) - before(current);
  return thread >= current ? difference : difference + count();
}

Generator forward() {
  return [](const Candidates& candidates) { return candidates.lowest(); };
}

Generator reverse() {
  return [](const Candidates& candidates) { return candidates.highest(); };
}

Generator round_robin() {
  return [](const Candidates& candidates) {
    const bool goes_on = candidates.contains(candidates.current);
    return candidates.nth(goes_on && candidates.count() > 1 ? 1 : 0);
  };
}

Generator random_walk(std::uint64_t seed) {
  return [random = SplitMix{seed}](const Candidates& candidates) mutable {
    return candidates.nth(random.below(candidates.count()));
  };
}

Generator pct(std::uint64_t seed, int depth, std::int64_t length) {
  if (depth < 1 || depth > 4) throw std::invalid_argument("pct: depth must be 1 to 4, not " + std::to_string(depth));
  if (length < 1) throw std::invalid_argument("pct: length must be positive, not " + std::to_string(length));
  SplitMix random{seed};
  std::vector<std::int64_t> changes;
  for (int i = 1; i < depth; ++i) {
    changes.push_back(static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(length)));
  }
  std::sort(changes.begin(), changes.end());
  // Lowered priorities are below all others, later ones below earlier ones.
  std::unordered_map<int, std::int64_t> lowered;
  return [salt = random(), changes, lowered, decision = std::int64_t{0},
          next = std::size_t{0}](const Candidates& candidates) mutable {
    const auto priority_of = [&](int thread) {
      const auto found = lowered.find(thread);
      if (found != lowered.end()) return found->second;
      SplitMix own{salt ^ (static_cast<std::uint64_t>(thread) * 0xD1B54A32D192ED03ull)};
      return static_cast<std::int64_t>(own() >> 2);
    };
    for (; next < changes.size() && changes[next] <= decision; ++next) {
      lowered[candidates.current] = -1 - static_cast<std::int64_t>(next);
    }
    ++decision;
    int best = -1;
    std::int64_t highest = 0;
    for (std::size_t place = 0; place < candidates.masks.size(); ++place) {
      for (std::uint32_t mask = candidates.masks[place]; mask != 0; mask &= mask - 1) {
        const int thread = static_cast<int>(place) * 32 + std::countr_zero(mask);
        const std::int64_t own = priority_of(thread);
        if (best < 0 || own > highest) best = thread, highest = own;
      }
    }
    return best;
  };
}

Generator replay(ThreadSchedule schedule) {
  return [schedule = std::move(schedule), next = std::size_t{0}](const Candidates& candidates) mutable {
    const int wanted = next < schedule.size() ? schedule[next++] : 0;
    return candidates.nth(wanted == 0 ? 0 : std::min(wanted, candidates.count() - 1));
  };
}

int preemptions(const ThreadSchedule& schedule) {
  return static_cast<int>(std::count_if(schedule.begin(), schedule.end(), [](auto choice) { return choice != 0; }));
}

ThreadSchedule shrink(ThreadSchedule schedule, const std::function<bool(const ThreadSchedule&)>& fails, int budget) {
  const auto without_tail_of_zeros = [](ThreadSchedule s) {
    while (!s.empty() && s.back() == 0) s.pop_back();
    return s;
  };
  const auto still_fails = [&](const ThreadSchedule& candidate) { return budget-- > 0 && fails(candidate); };
  // First the end, by bisection: the shortest failing beginning is usually much shorter than the whole.
  for (std::size_t cut = schedule.size() / 2; cut > 0; cut /= 2) {
    while (schedule.size() > cut) {
      ThreadSchedule shorter(schedule.begin(), schedule.end() - static_cast<std::ptrdiff_t>(cut));
      if (!still_fails(shorter)) break;
      schedule = std::move(shorter);
    }
  }
  // Then pieces, halved again and again (delta debugging, Zeller and Hildebrandt 2002): without a piece's preemptions,
  // without its decisions, with the nearest thread instead of a far one.
  using Change = std::function<ThreadSchedule(const ThreadSchedule&, std::size_t begin, std::size_t end)>;
  const Change calm = [](ThreadSchedule s, std::size_t begin, std::size_t end) {
    std::fill(s.begin() + static_cast<std::ptrdiff_t>(begin), s.begin() + static_cast<std::ptrdiff_t>(end), 0);
    return s;
  };
  const Change drop = [](ThreadSchedule s, std::size_t begin, std::size_t end) {
    s.erase(s.begin() + static_cast<std::ptrdiff_t>(begin), s.begin() + static_cast<std::ptrdiff_t>(end));
    return s;
  };
  const Change near = [](ThreadSchedule s, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) s[i] = std::min<std::uint16_t>(s[i], 1);
    return s;
  };
  // Fewer preemptions, then fewer decisions, then nearer threads.
  const auto size_of = [](const ThreadSchedule& s) {
    return std::tuple(preemptions(s), s.size(), std::accumulate(s.begin(), s.end(), std::int64_t{0}));
  };
  for (bool progress = true; progress && budget > 0;) {
    progress = false;
    for (const Change& change : {calm, drop, near}) {
      for (std::size_t piece = std::max<std::size_t>(schedule.size() / 2, 1); piece > 0 && budget > 0; piece /= 2) {
        for (std::size_t begin = 0; begin < schedule.size() && budget > 0;) {
          ThreadSchedule smaller = change(schedule, begin, std::min(begin + piece, schedule.size()));
          if (size_of(smaller) < size_of(schedule) && still_fails(smaller)) {
            progress = true;
            if (smaller.size() == schedule.size()) begin += piece;
            schedule = std::move(smaller);
          } else {
            begin += piece;
          }
        }
      }
    }
  }
  return without_tail_of_zeros(std::move(schedule));
}

}  // namespace cutproof::gpu
