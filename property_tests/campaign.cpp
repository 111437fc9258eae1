#include "property_tests/campaign.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <iterator>
#include <limits>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::property_tests {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

Judgement thrown(const std::string& backend, const std::string& what) {
  Judgement judgement;
  Verdict verdict;
  verdict.property = "runs to its end";
  verdict.backend = backend;
  verdict.holds = false;
  verdict.bound_source = "model/backend.h";
  verdict.witness.text = what;
  judgement.failure = std::move(verdict);
  return judgement;
}

// The exception of `run`, in words; empty: none. Exceptions of the machine pass through.
std::string problem_of(const std::function<void()>& run) {
  try {
    run();
    return {};
  } catch (const MachineError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const Refused&) {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  }
}

// One batch of cases, on its way through the threads.
struct Load {
  int64_t number = 0;
  std::vector<int64_t> indices;
  std::vector<Case> cases;
  std::vector<Instance> loaded;

  // Once it has been run.
  int device = 0;
  std::vector<CaseRun> runs;
  std::string backend;      // its name
  std::string problem;      // its exception; empty: none
  bool is_refused = false;  // which of the bodies shows where each is alone

  std::size_t claimed = 0, judged = 0;  // cases: to be judged by some thread; judged
  bool has_violation = false;
};

// Threads take the most urgent of three jobs: to generate a batch, to run one, to judge some cases of one.
class Runner {
 public:
  Runner(const CampaignOptions& options, const BackendSource& source,
         const std::function<void(const Campaign&)>& progress)
      : options_(options), source_(source), progress_(progress) {
    for (int k = options.backends; k-- > 0;) idle_.push_back({k % options.devices, nullptr});
  }

  Campaign run() {
    std::vector<std::thread> threads;
    for (int t = 0; t < options_.threads; ++t) threads.emplace_back([this] { work(); });
    for (std::thread& thread : threads) thread.join();
    if (error_) std::rethrow_exception(error_);
    auto& violations = campaign_.violations;
    std::sort(violations.begin(), violations.end(),
              [](const Violation& a, const Violation& b) { return a.index < b.index; });
    if (!options_.keep_going && violations.size() > 1) violations.erase(violations.begin() + 1, violations.end());
    campaign_.seconds = seconds_since(begin_);
    campaign_.stopped = stopped_;
    return std::move(campaign_);
  }

 private:
  using LoadPointer = std::shared_ptr<Load>;
  using Lock = std::unique_lock<std::mutex>;

  struct Place {
    int device;
    std::unique_ptr<Backend> backend;  // null: to be made
  };

  void work() {
    Lock lock(guard_);
    try {
      while (!error_) {
        drop_what_nobody_wants();
        // Where fewer batches can run than there are threads, a device must not wait for judges: one batch is ready
        // before a place is idle, and one may wait to be judged. Elsewhere a batch is judged while the caches hold it.
        const std::size_t ahead = options_.backends < options_.threads ? 1 : 0;
        const bool may_begin = waiting_.size() <= ahead;
        if (may_begin && !ready_.empty() && !idle_.empty()) {
          run_load(lock);
        } else if (may_begin && ready_.size() + generating_ < idle_.size() + ahead && may_generate()) {
          generate(lock);
        } else if (!waiting_.empty()) {
          judge(lock);
        } else if (generating_ == 0 && running_ == 0 && ready_.empty()) {
          break;  // threads that still judge make no new work
        } else {
          changed_.wait(lock);
        }
      }
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      if (!error_) error_ = std::current_exception();
    }
    changed_.notify_all();
  }

  bool time_is_over() const { return options_.seconds && seconds_since(begin_) >= *options_.seconds; }
  bool may_generate() {
    return options_.shard + next_ * options_.batch * options_.shards < options_.cases && next_ <= last_wanted_ &&
           !time_is_over() && !is_stopped();
  }
  // After a stop is asked, batches in progress count as far as they were judged.
  bool is_stopped() {
    if (is_asked(options_.stop_asked)) stopped_ = true;
    return stopped_;
  }
  // When its time is over without a judged case, some cases of batches in progress are still judged.
  bool is_over() { return is_stopped() || (time_is_over() && has_judged_); }
  // Batches begin in order, so the first violation is found.
  bool is_wanted(const LoadPointer& load) const { return load->number <= last_wanted_; }
  void drop_what_nobody_wants() {
    const bool is_all = is_over();
    for (std::deque<LoadPointer>* loads : {&ready_, &waiting_}) {
      std::erase_if(*loads, [&](const LoadPointer& load) { return is_all || !is_wanted(load); });
    }
  }

  void generate(Lock& lock) {
    const auto load = std::make_shared<Load>();
    load->number = next_++;
    ++generating_;
    lock.unlock();
    const Clock::time_point begin = Clock::now();
    for (int64_t k = load->number * options_.batch; k < (load->number + 1) * options_.batch; ++k) {
      const int64_t index = options_.shard + k * options_.shards;
      if (index >= options_.cases) break;
      load->indices.push_back(index);
      load->cases.push_back(case_at(options_, index));
      load->loaded.push_back(property_tests::instance_of(load->cases.back()));
    }
    const double generating = seconds_since(begin);
    lock.lock();
    campaign_.generating += generating;
    --generating_;
    ready_.push_back(load);
    changed_.notify_all();
  }

  void run_load(Lock& lock) {
    const LoadPointer load = ready_.front();
    ready_.pop_front();
    Place place = std::move(idle_.back());
    idle_.pop_back();
    ++running_;
    lock.unlock();
    if (!place.backend || source_.fresh) place.backend = source_.make(load->number, place.device);
    load->device = place.device;
    load->backend = place.backend->name();
    const Clock::time_point begin = Clock::now();
    try {
      load->problem = problem_of([&] { load->runs = run_cases(*place.backend, load->loaded); });
    } catch (const Refused& refused) {
      load->problem = refused.what();
      load->is_refused = true;
    }
    const double running = seconds_since(begin);
    if (!load->problem.empty()) place.backend.reset();  // a backend that threw is not used again
    lock.lock();
    campaign_.running += running;
    --running_;
    idle_.push_back(std::move(place));
    waiting_.push_back(load);
    changed_.notify_all();
  }

  Judgement judgement_of(Load& load, std::size_t k) {
    const Case& c = load.cases[k];
    if (!load.problem.empty()) {
      return dissect_alone([&] { return source_.make(load.number, load.device); }, c, true);
    }
    Judgement judgement =
        judge_case(c, load.loaded[k], load.runs[k], load.backend, load.indices[k] % options_.thorough == 0);
    load.runs[k] = {};  // states take most of a campaign's memory
    return judgement;
  }

  // Some cases of the batch that has waited longest.
  void judge(Lock& lock) {
    const LoadPointer load = waiting_.front();
    const std::size_t first = load->claimed, cases = load->cases.size();
    const std::size_t share = cases / static_cast<std::size_t>(options_.threads);
    load->claimed = std::min(cases, first + std::clamp<std::size_t>(share, 1, kMostJudgedAtOnce));
    const std::size_t end = load->claimed;
    if (end == cases) waiting_.pop_front();
    lock.unlock();
    const Clock::time_point begin = Clock::now();
    Campaign part;
    for (std::size_t k = first; k < end && (k == first || !is_over()); ++k) {
      add(part, *load, k, judgement_of(*load, k));
    }
    part.judging = seconds_since(begin) - part.reference;
    lock.lock();
    load->judged += at(part.cases);
    load->has_violation = load->has_violation || !part.violations.empty();
    const bool is_whole = load->judged == cases;
    if (is_whole && !load->problem.empty() && !load->is_refused && !load->has_violation) {
      part.violations.push_back(
          {load->indices.front(), load->cases.front(),
           *thrown(load->backend, "(only with the other bodies of its batch) " + load->problem).failure});
    }
    if (!part.violations.empty() && !options_.keep_going) last_wanted_ = std::min<int64_t>(last_wanted_, load->number);
    has_judged_ = true;
    join(std::move(part));
    campaign_.seconds = seconds_since(begin_);
    if (progress_) progress_(campaign_);
    changed_.notify_all();
  }

  static void add(Campaign& part, const Load& load, std::size_t k, Judgement judgement) {
    ++part.cases;
    part.verdicts += judgement.verdicts;
    part.refused += judgement.refused ? 1 : 0;
    part.particles += load.loaded[k].setup.body.particle_count();
    part.coverage.add(judgement.coverage);
    part.compared.join(judgement.compared);
    part.properties.join(judgement.properties);
    part.stages.join(judgement.stages);
    part.reference += judgement.reference_seconds;
    if (judgement.failure) part.violations.push_back({load.indices[k], load.cases[k], std::move(*judgement.failure)});
  }
  void join(Campaign part) {
    campaign_.cases += part.cases;
    campaign_.verdicts += part.verdicts;
    campaign_.refused += part.refused;
    campaign_.particles += part.particles;
    campaign_.coverage.add(part.coverage);
    campaign_.compared.join(part.compared);
    campaign_.properties.join(part.properties);
    campaign_.stages.join(part.stages);
    campaign_.reference += part.reference;
    campaign_.judging += part.judging;
    std::move(part.violations.begin(), part.violations.end(), std::back_inserter(campaign_.violations));
  }

  // Enough that threads seldom wait for each other, few enough that all threads share the last batch.
  static constexpr std::size_t kMostJudgedAtOnce = 16;

  const CampaignOptions& options_;
  const BackendSource& source_;
  const std::function<void(const Campaign&)>& progress_;
  const Clock::time_point begin_ = Clock::now();
  std::atomic<bool> stopped_{false}, has_judged_{false};

  std::mutex guard_;  // of all that follows
  std::condition_variable changed_;
  int64_t next_ = 0;  // load
  int64_t last_wanted_ = std::numeric_limits<int64_t>::max();
  std::vector<Place> idle_;
  std::size_t generating_ = 0, running_ = 0;  // threads
  std::deque<LoadPointer> ready_, waiting_;   // to be run; to be judged
  Campaign campaign_;
  std::exception_ptr error_;
};

// Beyond this the states of a batch take gigabytes.
constexpr int64_t kMostBodiesInALoad = 1024, kMostMovingBodiesInALoad = 256;

}  // namespace

int size_at(const CampaignOptions& options, int64_t index) {
  return options.least_size + static_cast<int>(index % (options.most_size - options.least_size + 1));
}

Case case_at(const CampaignOptions& options, int64_t index) {
  const int size = size_at(options, index);
  const uint64_t seed = options.seed + static_cast<uint64_t>(index);
  return options.dynamics ? draw_moving_case(seed, size) : draw_case(seed, size);
}

BackendSource source_of(const harness::BackendChoice& choice, const std::vector<int>& devices) {
  return {[choice, devices](int64_t load, int device) {
            harness::BackendChoice of_load = harness::choice_for_load(choice, load);
            of_load.device = devices.at(at(device));
            return harness::make_backend(of_load);
          },
          harness::described_backend(choice.name).takes_schedule};
}

void set_parallel_loads(CampaignOptions& options, const harness::BackendDescriptor& backend, int devices) {
  const int most = backend.most_parallel_loads > 0 ? backend.most_parallel_loads * devices : options.threads;
  options.backends = std::min(options.threads, most);
  options.devices = std::min(options.backends, devices);
}

int usual_batch(const CampaignOptions& options, const harness::BackendDescriptor& backend) {
  const int64_t least = backend.bodies_in_a_load;
  if (backend.particles_in_a_load == 0) return static_cast<int>(least);
  constexpr int64_t kAsked = 80;  // as many as the sizes that alternate by default
  int64_t particles = 0;
  for (int64_t index = 0; index < kAsked; ++index) particles += std::ssize(case_at(options, index).nodes);
  const int64_t loads = std::max(backend.most_parallel_loads, 1);
  const int64_t most = std::max(least, (options.cases + loads - 1) / loads);
  const int64_t wanted = backend.particles_in_a_load * kAsked / std::max<int64_t>(particles, 1);
  // A batch of moving bodies takes as long as the one with most frames, and judging begins after that.
  const int64_t at_once = options.dynamics ? kMostMovingBodiesInALoad : kMostBodiesInALoad;
  return static_cast<int>(std::clamp(wanted, least, std::min(most, at_once)));
}

Campaign run_campaign(const CampaignOptions& options, const BackendSource& source,
                      const std::function<void(const Campaign&)>& progress) {
  return Runner(options, source, progress).run();
}

namespace {

Judgement alone(const std::string& backend, const std::function<Judgement()>& judged) {
  Judgement judgement;
  try {
    const std::string problem = problem_of([&] { judgement = judged(); });
    return problem.empty() ? judgement : thrown(backend, problem);
  } catch (const Refused&) {
    judgement.refused = true;
    return judgement;
  }
}

}  // namespace

Judgement dissect_alone(const std::function<std::unique_ptr<Backend>()>& make, const Case& c, bool thorough) {
  const std::unique_ptr<Backend> backend = make();
  return alone(backend->name(), [&] { return dissect(*backend, c, thorough); });
}

Judgement history_alone(const std::function<std::unique_ptr<Backend>()>& make, const Case& c,
                        const std::vector<Command>& commands) {
  return alone(make()->name(), [&] {
    const History history = history_of(make, c, commands);
    Judgement judgement;
    judgement.verdicts = history.verdicts();
    judgement.failure = history.failure();
    return judgement;
  });
}

}  // namespace cutproof::property_tests
