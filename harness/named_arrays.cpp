#include "harness/named_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::harness {

namespace {

std::string shape_text(const std::vector<int64_t>& shape) {
  std::string text = "(";
  for (std::size_t k = 0; k < shape.size(); ++k) {
    text += (k > 0 ? ", " : "") + (shape[k] < 0 ? std::string("any") : fmt::format("{}", shape[k]));
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::string listed(const std::vector<KnownArray>& known, const std::vector<KnownArray>& more) {
  std::string names;
  for (const auto* const list : {&known, &more}) {
    for (const KnownArray& each : *list) names += (names.empty() ? "" : ", ") + std::string(each.name);
  }
  return names;
}

bool knows(const std::vector<KnownArray>& known, std::string_view name) {
  return std::any_of(known.begin(), known.end(), [&](const KnownArray& each) { return each.name == name; });
}

}  // namespace

bool is_real(const Array& array) { return array.type == ElementType::f32 || array.type == ElementType::f64; }

NamedArrays::NamedArrays(const io::ArrayFile& contents, const std::string& file, const std::vector<KnownArray>& known,
                         const std::vector<KnownArray>& known_texts)
    : contents_(contents), file_(file) {
  for (const Array& array : contents.arrays) {
    if (knows(known, array.name)) continue;
    if (knows(known_texts, array.name)) refuse(array.name, "This holds numbers.", "Write it as a text.");
    refuse(array.name, "There is no such array.",
           fmt::format("Leave it out. These are known: {}.", listed(known, known_texts)));
  }
  for (const io::NamedText& text : contents.texts) {
    if (knows(known_texts, text.name)) continue;
    if (knows(known, text.name)) refuse(text.name, "This is a text.", "Write it as an array of numbers.");
    refuse(text.name, "There is no such text.",
           fmt::format("Leave it out. These are known: {}.", listed(known_texts, known)));
  }
}

void NamedArrays::refuse(std::string_view name, const std::string& problem, const std::string& remedy) const {
  throw InputError(file_, std::string(name), problem, remedy);
}

const Array* NamedArrays::find(std::string_view name, const std::vector<int64_t>& shape) const {
  const Array* const array = find_array(contents_.arrays, name);
  if (array == nullptr) return nullptr;
  bool fits = array->shape.size() == shape.size();
  for (std::size_t k = 0; fits && k < shape.size(); ++k) fits = shape[k] < 0 || shape[k] == array->shape[k];
  if (!fits) {
    refuse(name, fmt::format("Its shape is {}, and should be {}.", shape_text(array->shape), shape_text(shape)),
           "Give one entry for each particle, cluster, edge, vertex or frame that the other arrays have.");
  }
  return array;
}

const Array& NamedArrays::require(std::string_view name, const std::vector<int64_t>& shape) const {
  const Array* const array = find(name, shape);
  if (array == nullptr) {
    refuse(name, "This array is not there.", fmt::format("Add it, of shape {}.", shape_text(shape)));
  }
  return *array;
}

const Array& NamedArrays::require_either(std::string_view name, const std::vector<int64_t>& shape,
                                         const std::vector<int64_t>& other) const {
  const Array* const array = find_array(contents_.arrays, name);
  return require(name, array != nullptr && array->shape.size() == other.size() ? other : shape);
}

bool NamedArrays::both(std::string_view a, std::string_view b) const {
  if (has(a) == has(b)) return has(a);
  const auto [there, missing] = has(a) ? std::pair(a, b) : std::pair(b, a);
  refuse(missing, fmt::format("This array is not there, and {} is.", there), "Give both or neither.");
}

void NamedArrays::require_whole(const Array& array) const {
  if (is_real(array)) {
    refuse(array.name, fmt::format("It holds {}, and should hold integers.", name_of(array.type)),
           "Write it as an array of integers.");
  }
}

std::vector<int64_t> NamedArrays::long_integers(const Array& array) const {
  require_whole(array);
  std::vector<int64_t> values(at(array.count()));
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = array.integer(static_cast<int64_t>(k));
  return values;
}

std::vector<int32_t> NamedArrays::integers(const Array& array) const {
  require_whole(array);
  std::vector<int32_t> values(at(array.count()));
  for (std::size_t k = 0; k < values.size(); ++k) {
    const int64_t value = array.integer(static_cast<int64_t>(k));
    if (value < std::numeric_limits<int32_t>::min() || value > std::numeric_limits<int32_t>::max()) {
      refuse(array.name, fmt::format("Entry {} is {}, which has more than 32 bits.", k, value),
             "Count particles, clusters and vertices from 0.");
    }
    values[k] = static_cast<int32_t>(value);
  }
  return values;
}

std::vector<double> NamedArrays::numbers(const Array& array) const {
  std::vector<double> values(at(array.count()));
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = array.number(static_cast<int64_t>(k));
  return values;
}

std::vector<Vec3> NamedArrays::vectors(const Array& array) const {
  if (!is_real(array)) {
    refuse(array.name, fmt::format("It holds {}, and should hold float32 or float64.", name_of(array.type)),
           "Write it as an array of floating-point numbers, in the precision in which it was computed.");
  }
  std::vector<Vec3> values(at(array.count() / 3));
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto first = static_cast<int64_t>(3 * k);
    values[k] = {array.number(first), array.number(first + 1), array.number(first + 2)};
  }
  return values;
}

std::optional<double> NamedArrays::number(std::string_view name) const {
  const Array* const array = find_array(contents_.arrays, name);
  if (array == nullptr) return std::nullopt;
  if (array->count() != 1 || array->shape.size() > 1) {
    refuse(name, fmt::format("Its shape is {}, and it should be a single number.", shape_text(array->shape)),
           "Write one number.");
  }
  return array->number(0);
}

std::optional<int64_t> NamedArrays::whole_number(std::string_view name) const {
  if (!number(name)) return std::nullopt;
  const Array& array = *find_array(contents_.arrays, name);
  require_whole(array);
  return array.integer(0);
}

}  // namespace cutproof::harness
