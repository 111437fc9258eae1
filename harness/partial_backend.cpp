#include "harness/partial_backend.h"

#include <stdexcept>
#include <utility>

namespace cutproof::harness {

namespace {

class PartialBackend final : public Backend {
 public:
  PartialBackend(std::unique_ptr<Backend> inner, std::string name, bool (*offers)(Span))
      : inner_(std::move(inner)), name_(std::move(name)), offers_(offers) {}

  std::string name() const override { return name_; }
  Precision precision() const override { return inner_->precision(); }
  bool can_run(Span span) const override { return offers_(span) && inner_->can_run(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    if (!can_run(span)) {
      throw std::logic_error("The backend " + name_ + " does not run " + std::string(cutproof::name_of(span.first)) +
                             " to " + std::string(cutproof::name_of(span.last)) + ".");
    }
    inner_->run(span);
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const override { return inner_->snapshot_of(wanted); }
  SpanReport report() const override { return inner_->report(); }

 private:
  std::unique_ptr<Backend> inner_;
  std::string name_;
  bool (*offers_)(Span);
};

}  // namespace

std::unique_ptr<Backend> offer_only(std::unique_ptr<Backend> inner, std::string name, bool (*can_run)(Span)) {
  return std::make_unique<PartialBackend>(std::move(inner), std::move(name), can_run);
}

}  // namespace cutproof::harness
