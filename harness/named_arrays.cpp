#include "harness/named_arrays.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "model/at.h"
#include "model/error.h"
#include "model/nearest_word.h"

namespace cutproof::harness {

namespace {

std::string shape_text(const std::vector<int64_t>& shape) {
  std::string text = "(";
  for (std::size_t k = 0; k < shape.size(); ++k) {
    text += (k > 0 ? ", " : "") + (shape[k] < 0 ? std::string("any") : fmt::format("{}", shape[k]));
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::vector<std::string_view> names_of(const std::vector<KnownArray>& known, const std::vector<KnownArray>& more) {
  std::vector<std::string_view> names;
  for (const auto* const list : {&known, &more}) {
    for (const KnownArray& each : *list) names.push_back(each.name);
  }
  return names;
}

std::string what_is_known(std::string_view given, const std::vector<KnownArray>& known,
                          const std::vector<KnownArray>& more) {
  const std::vector<std::string_view> names = names_of(known, more);
  const std::string meant = nearest_word(given, names);
  return fmt::format("{}Known names: {}.", meant.empty() ? "Leave it out. " : "Did you mean '" + meant + "'? ",
                     fmt::join(names, ", "));
}

bool knows(const std::vector<KnownArray>& known, std::string_view name) {
  return std::any_of(known.begin(), known.end(), [&](const KnownArray& each) { return each.name == name; });
}

using Shape = std::vector<int64_t>;

bool fits(const Shape& has, const Shape& wanted) {
  bool fits = has.size() == wanted.size();
  for (std::size_t k = 0; fits && k < has.size(); ++k) fits = wanted[k] < 0 || wanted[k] == has[k];
  return fits;
}

// A list of numbers as MATLAB has it, and an empty one as numpy has it.
bool fits_as_list(const Array& array, const Shape& wanted) {
  if (wanted.size() == 1 && array.shape.size() == 2 && std::min(array.shape[0], array.shape[1]) == 1) {
    return fits({array.count()}, wanted);
  }
  // Callers read free extents from the array: an empty list has the first extent alone.
  return array.shape == Shape{0} && !wanted.empty() && wanted.front() <= 0 &&
         std::none_of(wanted.begin() + 1, wanted.end(), [](int64_t extent) { return extent < 0; });
}

// Of a file that its own program calls v7.3, or that wrote column by column and did not say so.
bool fits_transposed(const Array& array, const Shape& wanted) {
  return fits(Shape(array.shape.rbegin(), array.shape.rend()), wanted);
}

}  // namespace

bool is_real(const Array& array) { return array.type == ElementType::f32 || array.type == ElementType::f64; }

Precision precision_of(const Array& array) {
  if (array.type != ElementType::f64) return array.type == ElementType::f32 ? Precision::binary32 : Precision::binary64;
  constexpr int kRoundBits = 16, kFraction = 52;
  bool tells = false;
  for (const double value : array.of<double>()) {
    if (value == 0 || !std::isfinite(value)) continue;
    if (static_cast<double>(static_cast<float>(value)) != value) return Precision::binary64;
    const uint64_t fraction = std::bit_cast<uint64_t>(value) & ((uint64_t{1} << kFraction) - 1);
    tells = tells || (fraction != 0 && kFraction + 1 - std::countr_zero(fraction) > kRoundBits);
  }
  return tells ? Precision::binary32 : Precision::binary64;
}

NamedArrays::NamedArrays(const io::ArrayFile& contents, const std::string& file, const std::vector<KnownArray>& known,
                         const std::vector<KnownArray>& known_texts)
    : contents_(contents), file_(file) {
  for (const Array& array : contents.arrays) {
    if (knows(known, array.name)) continue;
    if (knows(known_texts, array.name)) refuse(array.name, "This holds numbers.", "Write it as a text.");
    refuse(array.name, "There is no such array.", what_is_known(array.name, known, known_texts));
  }
  std::vector<std::string> passed_over;
  for (const io::NamedText& text : contents.texts) {
    if (knows(known_texts, text.name)) continue;
    if (knows(known, text.name)) refuse(text.name, "This is a text.", "Write it as an array of numbers.");
    const bool is_slip = std::any_of(known_texts.begin(), known_texts.end(), [&](const KnownArray& each) {
      return edit_distance(text.name, each.name) <= 1;  // of a letter, or of its case
    });
    if (text.is_attribute && !is_slip) {
      passed_over.push_back(text.name);
      continue;
    }
    refuse(text.name, "There is no such text.", what_is_known(text.name, known_texts, known));
  }
  for (const std::string& name : contents.ignored) {
    if (knows(known_texts, name)) refuse(name, "This attribute is no text.", "Write it as a text.");
    if (knows(known, name)) refuse(name, "This is an attribute.", "Write it as a dataset.");
    passed_over.push_back(name);
  }
  if (!passed_over.empty()) {
    notes_.push_back(fmt::format("Unknown attributes of the file were ignored: {}.", fmt::join(passed_over, ", ")));
  }
}

void NamedArrays::refuse(std::string_view name, const std::string& problem, const std::string& remedy) const {
  throw InputError(file_, std::string(name), problem, remedy);
}

const Array* NamedArrays::find(std::string_view name, const std::vector<int64_t>& shape) const {
  const Array* const array = find_array(contents_.arrays, name);
  if (array == nullptr) return nullptr;
  if (fits(array->shape, shape) || fits_as_list(*array, shape)) return array;
  if (fits_transposed(*array, shape)) {
    refuse(name,
           fmt::format("It is transposed: its shape is {}, and should be {}.", shape_text(array->shape),
                       shape_text(shape)),
           "Write its transpose. MATLAB's own files have every array transposed: write permute(A, ndims(A):-1:1).");
  }
  refuse(name, fmt::format("Its shape is {}, and should be {}.", shape_text(array->shape), shape_text(shape)),
         "Give one entry for each particle, cluster, edge, vertex or frame that the other arrays have.");
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
  if (is_real(array) && array.count() > 0) {
    refuse(array.name, fmt::format("It holds {}, and should hold integers.", name_of(array.type)),
           "Write it as an array of integers, in numpy by array.astype(numpy.int32), in MATLAB by int32(array).");
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
  if (array->count() != 1 || array->shape.size() > 2) {
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
