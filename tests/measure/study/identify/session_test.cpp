#include <gtest/gtest.h>

#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/friction_identification.h"
#include "tests/measure/study/common/simulated_session.h"
#include "tests/support/value_of.h"

namespace hapticd::study {
namespace {

/// Loses what a busy machine would: some ticks, again and again.
class Gappy final : public identification::Identification {
 public:
  Gappy(identification::Identification& identification, int every, int lost)
      : identification_(identification), every_(every), lost_(lost) {}
  void add(const rt::Observation& observation) override {
    if (++ticks_ % every_ >= lost_) identification_.add(observation);
  }
  identification::MotionRequest next_request() const override { return identification_.next_request(); }
  identification::IdentificationProgress progress() const override { return identification_.progress(); }
  hal::Result<rt::IdentifiedModel> finish() const override { return identification_.finish(); }

 private:
  identification::Identification& identification_;
  int every_, lost_;
  int ticks_ = 0;
};

/// Asks for progress as often as a daemon does that shows it.
class Watched final : public identification::Identification {
 public:
  Watched(identification::Identification& identification, int every)
      : identification_(identification), every_(every) {}
  void add(const rt::Observation& observation) override {
    identification_.add(observation);
    if (++ticks_ % every_ == 0) (void)identification_.progress();
  }
  identification::MotionRequest next_request() const override { return identification_.next_request(); }
  identification::IdentificationProgress progress() const override { return identification_.progress(); }
  hal::Result<rt::IdentifiedModel> finish() const override { return identification_.finish(); }

 private:
  identification::Identification& identification_;
  int every_;
  int ticks_ = 0;
};

TEST(FrictionSession, ConvergesHoweverOftenItsProgressIsAskedFor) {
  sim::SimulationConfig rig;
  rig.device = "phantom_1_0";
  rig.object = "foam_ball_3d";
  const hal::RigInfo info = (*sim::SimulatedRig::create(rig))->info();
  for (const int every_ticks : {50, 100}) {
    identification::FrictionIdentification identification(identification::FrictionTask{}, info);
    Watched watched(identification, every_ticks);
    const SessionResult result = run_session(watched, rig, 60.0);
    EXPECT_GT(result.converged_s, 0.0) << "asked every " << every_ticks << " ticks";
  }
}

TEST(ContactSession, ConvergesThoughTicksAreLostEverySecond) {
  sim::SimulationConfig rig;
  rig.device = "phantom_1_5_high_force";
  rig.object = "rubber_ball_3d";
  const hal::RigInfo info = (*sim::SimulatedRig::create(rig))->info();
  double whole_s = 0.0;
  for (const int lost : {0, 6, 20}) {
    identification::ContactIdentification identification(identification::ContactTask{}, info);
    Gappy gappy(identification, 1000, lost);
    const SessionResult result = run_session(gappy, rig, 60.0);
    ASSERT_GT(result.converged_s, 0.0) << lost << " of 1000 ticks lost";
    if (lost == 0) whole_s = result.converged_s;
    EXPECT_LT(result.converged_s, whole_s + 5.0) << lost << " of 1000 ticks lost";
    const auto model = test::value_of(identification.finish());
    EXPECT_TRUE(model.converged);
  }
}

}  // namespace
}  // namespace hapticd::study
