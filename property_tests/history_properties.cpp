// Properties of every backend over histories of commands (histories.h), by rapidcheck's state.h.
#include <rapidcheck/state.h>

#include <algorithm>
#include <iostream>

#include "property_tests/checking.h"
#include "property_tests/counterexample.h"
#include "property_tests/histories.h"

namespace cutproof::property_tests {
namespace {

constexpr int kMostCommands = 20;
constexpr int64_t kMostFrames = 16;

// A command as rapidcheck knows it. Its model is where the history is; any command may come anywhere, so every shorter
// history is one too.
class GivenCommand final : public rc::state::Command<Position, History> {
 public:
  explicit GivenCommand(property_tests::Command command) : command_(std::move(command)) {}
  const property_tests::Command& command() const { return command_; }

  void checkPreconditions(const Position& at) const override { RC_PRE(after(at, command_).frame <= kMostFrames); }
  void apply(Position& at) const override { at = after(at, command_); }
  void run(const Position&, History& history) const override { history.execute(command_); }
  void show(std::ostream& os) const override { os << to_json(command_); }

 private:
  property_tests::Command command_;
};
using CommandPointer = std::shared_ptr<const GivenCommand::CommandType>;

// inRange draws from a part of the range at sizes below 100.
rc::Gen<int32_t> between(int32_t low, int32_t high) {
  return rc::gen::resize(100, rc::gen::inRange<int32_t>(low, high + 1));
}

// Shrinks as the strokes of a case do.
rc::Gen<Stroke> random_strokes(const Case& c) {
  return [c](const rc::Random& random, int) {
    rc::Random source(random);
    return rc::shrinkable::shrinkRecur(draw_stroke(source.next(), c), [](const Stroke& stroke) {
      Case alone;
      alone.strokes = {stroke};
      std::vector<Stroke> simpler;
      for (const auto& edit : simplifications(alone)) {
        Case edited = alone;
        edit(edited);
        if (!edited.strokes.empty() && !(edited.strokes == alone.strokes)) simpler.push_back(edited.strokes.front());
      }
      return rc::seq::fromContainer(std::move(simpler));
    });
  };
}

// Between frames more strokes; within frames more loads, where loading loses more.
rc::Gen<CommandPointer> random_commands(const Case& c, Position at) {
  const auto given = [](property_tests::Command command) -> CommandPointer {
    return std::make_shared<GivenCommand>(std::move(command));
  };
  const auto coin = rc::gen::resize(100, rc::gen::arbitrary<bool>());
  const auto runs = rc::gen::apply(
      [=](int32_t stages, bool whole) {
        return given(RunStages{stages, whole});
      },
      between(1, 9), coin);
  const auto cuts = rc::gen::map(random_strokes(c), [=](const Stroke& stroke) { return given(Cut{stroke}); });
  const auto kicks = rc::gen::apply(
      [=](int32_t component, int32_t x, int32_t y, int32_t z) {
        return given(Kick{component, {x, y, z}});
      },
      between(0, 7), between(-4, 4), between(-4, 4), between(-4, 4));
  const auto loads = rc::gen::map(between(0, 4), [=](int32_t way) { return given(SaveAndLoad{way == 4}); });
  const bool within = at.next != Stage::step;
  return rc::gen::weightedOneOf<CommandPointer>(
      {{10, runs}, {within ? 1 : 8, cuts}, {2, kicks}, {within ? 10 : 2, loads}});
}

// Histories bring strokes of their own, so their cases have one at most. Half of them move.
Case draw_any_case(uint64_t seed, int size) {
  Case c = seed % 2 == 0 ? draw_case(seed, size) : draw_moving_case(seed, size);
  c.strokes.resize(std::min<std::size_t>(c.strokes.size(), 1));
  c.together = 1;
  return c;
}

TEST_P(EveryBackend, KeepsEveryPromiseThroughHistoriesOfCommands) {
  constexpr int kMostSize = 55;
  HistoryCoverage seen;
  int64_t histories = 0, commands_given = 0, verdicts = 0;
  const auto deadline = std::make_shared<Deadline>();
  const auto cases = random_cases(deadline, draw_any_case);
  check(id(), cases_of(3), std::min(kMostSize, GetParam().most_size), *deadline, [&] {
    const Case c = *cases;
    const auto commands = *rc::gen::resize(
        kMostCommands - 1,
        rc::state::gen::commands(Position{}, [c](const Position& at) { return random_commands(c, at); }));
    Counterexample example;
    example.failing = c;
    for (const auto& command : commands) {
      example.commands.push_back(static_cast<const GivenCommand&>(*command).command());
    }
    try {
      History history(GetParam().make, c);
      rc::state::runAll(commands, Position{}, history);
      ++histories;
      commands_given += static_cast<int64_t>(commands.size());
      verdicts += history.verdicts();
      seen.add(history.coverage());
      if (history.failure()) example.found = describe(*history.failure());
    } catch (const std::exception& error) {
      example.found = std::string("throws: ") + error.what();
    }
    return Example{to_json(example), example.found};
  });
  std::cout << histories << " histories, " << commands_given << " commands, " << verdicts << " verdicts;";
  report(seen, "history");
}

}  // namespace
}  // namespace cutproof::property_tests
