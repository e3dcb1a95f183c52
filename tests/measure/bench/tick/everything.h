#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "rt/scene/pipeline.h"

namespace hapticd::bench {

/// What a loop would do that composes nothing: the stages of all pipelines are evaluated at every tick and
/// all channels filled; the force is that of the first.
class Everything final : public rt::Pipeline {
 public:
  explicit Everything(std::vector<std::unique_ptr<rt::Pipeline>> pipelines)
      : pipelines_(std::move(pipelines)) {}

  std::uint32_t channels() const noexcept override {
    std::uint32_t all = 0;
    for (const auto& pipeline : pipelines_) all |= pipeline->channels();
    return all;
  }
  rt::PipelineOutput evaluate(const hal::RigSample& sample) noexcept override {
    rt::PipelineOutput output;
    for (auto pipeline = pipelines_.rbegin(); pipeline != pipelines_.rend(); ++pipeline)
      output = (*pipeline)->evaluate(sample);
    return output;
  }
  void fill_record(rt::TickRecord& record) const noexcept override {
    // Last to first, so that the first has the last word where several fill the same.
    for (auto pipeline = pipelines_.rbegin(); pipeline != pipelines_.rend(); ++pipeline)
      (*pipeline)->fill_record(record);
  }
  void applied(const hal::Vector3& force_n) noexcept override {
    for (const auto& pipeline : pipelines_) pipeline->applied(force_n);
  }
  void reset() noexcept override {
    for (const auto& pipeline : pipelines_) pipeline->reset();
  }
  void set_target(const rt::TargetLaw& target, double ramp_s) noexcept override {
    for (const auto& pipeline : pipelines_) pipeline->set_target(target, ramp_s);
  }

 private:
  std::vector<std::unique_ptr<rt::Pipeline>> pipelines_;
};

}  // namespace hapticd::bench
