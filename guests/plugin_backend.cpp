#include "guests/plugin_backend.h"

#include <algorithm>
#include <chrono>
#include <type_traits>
#include <utility>

#include "guests/tissue_arrays.h"
#include "model/at.h"
#include "model/coordinates.h"
#include "model/error.h"
#include "model/fields.h"
#include "model/rules.h"
#include "model/setup_fields.h"

namespace cutproof::guests {

namespace {

template <class T>
inline constexpr bool is_vector = false;
template <class T>
inline constexpr bool is_vector<std::vector<T>> = true;

// --- To arrays -------------------------------------------------------------------------------------------------------

void put(std::vector<double>& to, double value) { to.push_back(value); }
void put(std::vector<double>& to, const Vec3& v) { to.insert(to.end(), {v.x, v.y, v.z}); }
void put(std::vector<double>& to, const Mat3& m) { to.insert(to.end(), m.m.begin(), m.m.end()); }

// A list of values as an array of as many rows. Real numbers are f64.
template <class T>
Array array_of(std::string name, const std::vector<T>& values) {
  const auto rows = static_cast<int64_t>(values.size());
  if constexpr (std::is_same_v<T, Vec3> || std::is_same_v<T, Mat3> || std::is_same_v<T, double>) {
    std::vector<double> numbers;
    for (const T& value : values) put(numbers, value);
    const int64_t columns = std::is_same_v<T, Vec3> ? 3 : std::is_same_v<T, Mat3> ? 9 : 1;
    return make_array(std::move(name), {rows, columns}, numbers);
  } else if constexpr (std::is_same_v<T, std::array<int32_t, 3>>) {
    std::vector<int32_t> numbers;
    for (const T& value : values) numbers.insert(numbers.end(), value.begin(), value.end());
    return make_array(std::move(name), {rows, 3}, numbers);
  } else if constexpr (std::is_enum_v<T>) {
    std::vector<int32_t> numbers;
    for (const T value : values) numbers.push_back(static_cast<int32_t>(value));
    return make_array(std::move(name), {rows}, numbers);
  } else {
    return make_array(std::move(name), {rows}, values);
  }
}
template <class T>
Array array_of_one(std::string name, const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return array_of(std::move(name), std::vector<uint8_t>{value ? uint8_t{1} : uint8_t{0}});
  } else {
    return array_of(std::move(name), std::vector<T>{value});
  }
}

// --- From arrays -----------------------------------------------------------------------------------------------------

template <class T>
void take(const Array& array, std::vector<T>& to) {
  to.resize(at(array.rows()));
  for (int64_t row = 0; row < array.rows(); ++row) {
    T& value = to[at(row)];
    if constexpr (std::is_same_v<T, Vec3>) {
      value = {array.number(3 * row), array.number(3 * row + 1), array.number(3 * row + 2)};
    } else if constexpr (std::is_same_v<T, Mat3>) {
      for (int64_t k = 0; k < 9; ++k) value.m[at(k)] = array.number(9 * row + k);
    } else if constexpr (std::is_same_v<T, std::array<int32_t, 3>>) {
      for (int64_t k = 0; k < 3; ++k) value[at(k)] = static_cast<int32_t>(array.integer(3 * row + k));
    } else if constexpr (std::is_same_v<T, double>) {
      value = array.number(row);
    } else {
      value = static_cast<T>(array.integer(row));
    }
  }
}
template <class T>
void take(const Array& array, T& to) {
  if constexpr (std::is_same_v<T, bool>) {
    to = array.integer(0) != 0;
  } else {
    std::vector<T> one;
    take(array, one);
    to = one.at(0);
  }
}

std::string name_in_call(const Field& field) { return "state/" + std::string(field.name); }

Arrays arrays_of(const State& state, Precision precision) {
  Arrays arrays;
  for_each_field([&](const Field& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(state))>;
    if constexpr (is_vector<T>) {
      arrays.push_back(in_precision(array_of(name_in_call(field), get(state)), precision));
    } else {
      arrays.push_back(in_precision(array_of_one(name_in_call(field), get(state)), precision));
    }
  });
  return arrays;
}

void take_state(const Arrays& arrays, State& state) {
  for_each_field([&](const Field& field, auto get) {
    if (const Array* const array = find_array(arrays, name_in_call(field))) take(*array, get(state));
  });
}

// Lists of structs as an array for each field; one that is a list itself as all of them in a row, with offsets.
template <class Entry>
void add_entries(Arrays& arrays, const std::vector<Entry>& entries) {
  for_each_entry_field<Entry>([&](const SetupField& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(entries[0]))>;
    const std::string name = std::string(field.group) + "/" + std::string(field.name);
    if constexpr (is_vector<T>) {
      std::vector<int64_t> offsets = {0};
      T all;
      for (const Entry& entry : entries) {
        all.insert(all.end(), get(entry).begin(), get(entry).end());
        offsets.push_back(static_cast<int64_t>(all.size()));
      }
      arrays.push_back(array_of(name + "_offsets", offsets));
      arrays.push_back(array_of(name, all));
    } else {
      using Stored = std::conditional_t<std::is_same_v<T, bool>, uint8_t, T>;
      std::vector<Stored> column;
      for (const Entry& entry : entries) column.push_back(static_cast<Stored>(get(entry)));
      arrays.push_back(array_of(name, column));
    }
  });
}

// Whether the tissue that a guest is given has this field already.
bool is_of_tissue(const SetupField& field) { return field.group == "body" && field.name != "surface_crossing"; }

// All fields of a setup but those.
Arrays arrays_of(const Setup& setup) {
  Arrays arrays;
  for_each_setup_field([&](const SetupField& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(setup))>;
    if (is_of_tissue(field)) return;
    const std::string name =
        field.group.empty() ? std::string(field.name) : std::string(field.group) + "/" + std::string(field.name);
    if constexpr (is_list_of_entries<T>) {
      add_entries(arrays, get(setup));
    } else if constexpr (is_vector<T>) {
      arrays.push_back(array_of(name, get(setup)));
    } else if constexpr (std::is_same_v<T, std::string> || std::is_same_v<T, std::array<int32_t, 3>>) {
      // Of bodies only.
    } else {
      arrays.push_back(array_of_one(name, get(setup)));
    }
  });
  return arrays;
}

// --- The backend -----------------------------------------------------------------------------------------------------

class PluginBackend final : public Backend {
 public:
  explicit PluginBackend(const std::string& name) : name_(name), guest_(options_of_name(name)) {
    if (!guest_.plugin().offers(wire::load) || !guest_.plugin().offers(wire::run)) {
      throw InputError("command line", "--backend", "the plugin has no stages: 'load' and 'run' are both needed",
                       "judge its other operations with `cutproof judge`");
    }
  }

  std::string name() const override { return name_; }
  Precision precision() const override { return guest_.plugin().precision; }
  bool can_run(Span span) const override { return guest_.plugin().can_run(span); }
  std::string promises() const override { return guest_.plugin().promises.value_or(kAllPromises); }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    if (setups.size() != states.size())
      throw std::invalid_argument("plugin, load: the numbers of states and setups differ");
    setups_ = std::move(setups);
    states_ = std::move(states);
    setup_arrays_.clear();
    report_ = {};
    for (std::size_t b = 0; b < setups_.size(); ++b) {
      setup_arrays_.push_back(arrays_of(setups_[b]));
      load_body(b);
    }
    restarts_ = guest_.restarts();
  }

  void run(Span span) override {
    report_ = {};
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t b = 0; b < setups_.size(); ++b) {
      if (states_[b].frame < setups_[b].frame_count()) run_body(b, span);
    }
    report_.total_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  std::vector<State> snapshot() const override { return states_; }
  SpanReport report() const override { return report_; }

 private:
  std::vector<Argument> setup_arguments(std::size_t b) const {
    std::vector<Argument> arguments;
    for (const Array& array : setup_arrays_[b]) {
      arguments.push_back(given(array));
      arguments.back().role = Role::setup;
    }
    return arguments;
  }

  void load_body(std::size_t b) {
    std::vector<Argument> arguments = setup_arguments(b);
    Arrays tissue;
    for (const Array& array : tissue_arrays(setups_[b].body)) {
      tissue.push_back(in_precision_of_tissue(array, precision()));
    }
    const Arrays state = arrays_of(states_[b], precision());
    for (const Array& array : tissue) arguments.push_back(given_of_tissue(array));
    for (const Array& array : state) arguments.push_back(given(array));
    const Answer answer = guest_.call(wire::load, static_cast<uint32_t>(b), {}, arguments, turn());
    if (answer.kind == Answer::Kind::refused) throw Refused("the plugin, load: " + answer.text);
    if (answer.kind == Answer::Kind::fault) throw std::runtime_error("load: " + answer.text);
    take_state(state, states_[b]);  // rounded, where it is in single precision
    note_rounding(setups_[b].body, states_[b]);
  }

  void run_body(std::size_t b, Span span) {
    const Setup& setup = setups_[b];
    State next = states_[b];
    if (span.first == Stage::step) {
      next.removed.clear();
      next.debris.clear();
      next.impulse = {};
    }
    const int64_t frame = next.frame;
    // Of a single stage it is known beforehand whether it is due; in a longer span the plugin knows.
    const bool one = span.first == span.last;
    if (!one || is_due(setup, span.first, !next.removed.empty(), next.edge_covered)) {
      if (guest_.restarts() != restarts_) reload();
      const auto begin = std::chrono::steady_clock::now();
      ask(b, span, next);
      if (one) {
        report_.seconds[at(span.first)] +=
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      }
      // An earlier stage of the span changes what is due after it.
      const State& before = states_[b];
      for (const Stage stage : kStages) {
        const bool removed = span.first <= Stage::detect ? !next.removed.empty() : !before.removed.empty();
        if (span.contains(stage) && is_due(setup, stage, removed, before.edge_covered)) report_.ran[at(stage)] = true;
      }
    }
    if (span.contains(Stage::skin)) {
      next.frame = frame + 1;
      for (std::size_t c = 0; c < next.clusters.number.size(); ++c) {
        next.clusters.number[c] = static_cast<int32_t>(c);
      }
    }
    note_rounding(setup.body, next);
    states_[b] = std::move(next);
  }

  void ask(std::size_t b, Span span, State& state) {
    std::vector<Argument> arguments = setup_arguments(b);
    const Arrays given_state = arrays_of(state, precision());
    for (const Array& array : given_state) {
      arguments.push_back(given(array));
      arguments.back().role = Role::grown;
    }
    const Answer answer = guest_.call(wire::run, static_cast<uint32_t>(b), span, arguments, turn());
    const std::string what = std::string(cutproof::name_of(span.first)) +
                             (span.first == span.last ? "" : " to " + std::string(cutproof::name_of(span.last)));
    if (answer.kind == Answer::Kind::refused) throw Refused("the plugin, " + what + ": " + answer.text);
    if (answer.kind == Answer::Kind::fault) throw std::runtime_error(what + ": " + answer.text);
    for (const char* const one : {"frame", "tau", "cap", "edge_covered", "impulse"}) {
      if (find_array(answer.arrays, std::string("state/") + one)->rows() != 1) {
        throw std::runtime_error(what + ": it leaves '" + one + "' without its one value");
      }
    }
    const std::vector<double> reaches_before = state.skin.reach;
    take_state(answer.arrays, state);
    // A guest built before there were reaches leaves those that it was given, however many vertices it makes. Any other
    // number of them is for "well formed" to find.
    if (state.skin.reach.size() != state.skin.owner.size() && same_bits(state.skin.reach, reaches_before)) {
      state.skin.reach = uncut_reaches(setups_[b], state.skin);
    }
    if (state.clusters.offsets.empty()) state.clusters.offsets = {0};
  }

  // Places are handed over and come back as absolute coordinates of the body's frame.
  void note_rounding(const Body& body, State& state) const {
    state.precision = std::max(state.precision, precision());
    if (precision() != Precision::binary64) state.place_rounding = rounding_of_coordinates(body, state);
  }

  // A restarted process has no body.
  void reload() {
    for (std::size_t b = 0; b < setups_.size(); ++b) load_body(b);
    restarts_ = guest_.restarts();
  }

  bool turn() { return (++calls_ % 2) != 0; }

  static constexpr const char* kAllPromises = "*";
  std::string name_;
  Guest guest_;
  std::vector<Setup> setups_;
  std::vector<State> states_;
  std::vector<Arrays> setup_arrays_;
  SpanReport report_;
  int64_t calls_ = 0, restarts_ = 0;
};

}  // namespace

GuestOptions options_of_name(const std::string& name) {
  const std::string rest = name.substr(std::string(kPluginPrefix).size());
  const std::size_t comma = rest.find(',');
  GuestOptions options;
  options.library = rest.substr(0, comma);
  if (comma != std::string::npos) options.parameters = rest.substr(comma + 1);
  return options;
}

std::unique_ptr<Backend> make_plugin_backend(const std::string& name) { return std::make_unique<PluginBackend>(name); }

}  // namespace cutproof::guests
