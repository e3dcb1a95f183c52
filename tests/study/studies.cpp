#include "tests/study/rig/rig_study.h"
#include "tests/study/study.h"

namespace hapticd::study {

const std::vector<Study>& studies() {
  static const std::vector<Study> all{
      {"rig",
       "the one-dimensional system on the simulated rig and on real recordings",
       {
           {"rendered", "stiffness at the simulated hand against the target", run_rendered_stiffness},
           {"contact", "false alarms in free motion, delay of detection", run_contact},
           {"stability", "largest stable targets and walls, sensitivity to uncertain parameters", run_stability},
           {"speed", "simulated time over wall-clock time", run_speed},
           {"recordings", "contact, stiffness and rendered force on real recordings", run_recordings},
       }},
  };
  return all;
}

}  // namespace hapticd::study
