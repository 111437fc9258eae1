// Numbers in sentences for people. JSON keeps all digits.
#pragma once
#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <utility>

namespace cutproof::oracles {

inline constexpr int kFigureDigits = 6;  // significant ones, at most

inline std::string figure(double value) { return fmt::format("{:.{}g}", value, kFigureDigits); }

// As many digits more as tell it from another value, such as the limit that it exceeds by a hair.
inline std::string figure_beside(double value, double other) {
  std::string text = figure(value);
  for (int digits = kFigureDigits + 1; digits <= 17 && value != other; ++digits) {
    if (text != fmt::format("{:.{}g}", other, digits - 1)) break;
    text = fmt::format("{:.{}g}", value, digits);
  }
  return text;
}

// A floating-point number among the arguments of a sentence: as a figure, unless the sentence says how.
struct Figure {
  double value;
};
template <class T>
using Readable = std::conditional_t<std::is_floating_point_v<std::remove_cvref_t<T>>, Figure, T>;

template <class T>
Readable<T&&> readable(T&& value) {
  if constexpr (std::is_floating_point_v<std::remove_cvref_t<T>>) {
    return {value};
  } else {
    return std::forward<T>(value);
  }
}

template <class... Args>
std::string sentence(fmt::format_string<Readable<Args>...> text, Args&&... args) {
  const auto filled = [&](auto&&... shown) { return fmt::vformat(text, fmt::make_format_args(shown...)); };
  return filled(readable(std::forward<Args>(args))...);
}

}  // namespace cutproof::oracles

template <>
struct fmt::formatter<cutproof::oracles::Figure> : fmt::formatter<double> {
  constexpr auto parse(format_parse_context& context) {
    is_plain_ = context.begin() == context.end() || *context.begin() == '}';
    return fmt::formatter<double>::parse(context);
  }
  template <class Context>
  auto format(const cutproof::oracles::Figure& figure, Context& context) const {
    if (is_plain_) return fmt::format_to(context.out(), "{}", cutproof::oracles::figure(figure.value));
    return fmt::formatter<double>::format(figure.value, context);
  }

 private:
  bool is_plain_ = true;
};
