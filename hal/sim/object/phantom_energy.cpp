#include "hal/sim/object/phantom_energy.h"

#include <algorithm>
#include <array>

namespace hapticd::sim {

namespace {

// Fitted by tests/measure/study/tumour/body (fit.cpp) to what a finite-element body of the half-sphere answers when a
// ball of 8 mm presses it down to 18 mm: EcoFlex 00-30 with 50 % thinner, Yeoh of third order by its true
// stress (C 4.52, 0.013, 0.097 kPa), nearly incompressible, bonded to the table; the sphere 100 times as
// stiff. "Left over": rms of energy and forces (weighted by 3 mm) that the smooth function leaves, mesh noise
// included. N·mm, mm, rad.

// Left over: 2.4 %.
const ReducedFunction kTissue{{2, 2.5, 3, 4},
                              0.0000,
                              18,
                              {{{-0.052248, 0.18681, -0.15366, 0},
                                {0.097505, -0.041314, 0.036732, 0},
                                {-0.0074174, -0.0059944, 0.0040799, 0},
                                {6.2537e-06, 0.00036632, -0.00030543, 0}}}};

// Left over: 9.1 %.
const ReducedFunction kExcess19{{2, 3, 4, 5},
                                0.3600,
                                18,
                                {{{0.33275, -1.0754, 0.93073, -0.21832},
                                  {-0.069906, 0.33984, -0.30142, 0.072202},
                                  {0.010094, -0.037056, 0.031871, -0.0073938},
                                  {-0.00034139, 0.0011563, -0.00097452, 0.0002223}}}};

// Left over: 2.5 %.
const ReducedFunction kAlong19{{1, 1.5, 2, 3},
                               0.3600,
                               18,
                               {{{-0.38195, 1.3129, -1.1887, 0.24868},
                                 {0.39927, -1.5854, 1.3351, -0.27988},
                                 {-0.17137, 0.53151, -0.43868, 0.091774},
                                 {0.0045724, -0.012889, 0.010436, -0.0021966}}}};

// Left over: 3.3 %.
const ReducedFunction kAcross19{{1, 1.5, 2, 3},
                                0.3600,
                                18,
                                {{{-5.5253, 13.543, -10.05, 3.0449},
                                  {5.754, -15.561, 11.746, -3.4904},
                                  {-1.8856, 4.7842, -3.6435, 1.0186},
                                  {0.043133, -0.11275, 0.086204, -0.022144}}}};

// Left over: 6.1 %.
const ReducedFunction kExcess25{{2, 3, 4, 5},
                                0.3600,
                                18,
                                {{{0.07563, -0.12861, 0.11663, -0.023231},
                                  {-0.012161, 0.046792, -0.039923, 0.010105},
                                  {0.0021292, -0.0038139, 0.003178, -0.00076656},
                                  {-5.151e-05, 7.0132e-05, -5.4482e-05, 1.3537e-05}}}};

// Left over: 1.4 %.
const ReducedFunction kAlong25{{1, 1.5, 2, 3},
                               0.3600,
                               18,
                               {{{-0.25638, 0.62767, -0.40793, 0.052595},
                                 {0.23075, -0.64974, 0.3877, -0.052318},
                                 {-0.075733, 0.16855, -0.10585, 0.015135},
                                 {0.0012256, -0.002456, 0.0016162, -0.00024515}}}};

// Left over: 2.2 %.
const ReducedFunction kAcross25{{1, 1.5, 2, 3},
                                0.3600,
                                18,
                                {{{-3.6309, 8.7155, -8.0177, 2.2847},
                                  {3.4202, -8.8263, 7.8772, -2.3058},
                                  {-0.94483, 2.2461, -1.9793, 0.57002},
                                  {0.014129, -0.034065, 0.028606, -0.0082411}}}};

// Left over: 9.3 %.
const ReducedFunction kExcess31{{2, 3, 4, 5},
                                0.3600,
                                18,
                                {{{0.0079076, 0.027229, 0.011136, -0.0038967},
                                  {0.0029713, -0.0012985, -0.0083456, 0.004412},
                                  {4.5749e-05, 0.00061616, 0.00043664, -0.00028708},
                                  {6.2023e-06, -2.5409e-05, -1.4488e-06, 5.3697e-06}}}};

// Left over: 0.8 %.
const ReducedFunction kAlong31{{1, 1.5, 2, 3},
                               0.3600,
                               18,
                               {{{0.024612, -0.12185, 0.054866, -0.020316},
                                 {-0.045566, 0.10789, -0.060404, 0.016876},
                                 {0.0077162, -0.031932, 0.012413, -0.0030532},
                                 {-0.00027436, 0.00064427, -0.00012688, 3.1756e-07}}}};

// Left over: 2.0 %.
const ReducedFunction kAcross31{{1, 1.5, 2, 3},
                                0.3600,
                                18,
                                {{{-0.094149, 0.49108, -1.2908, 0.74597},
                                  {-0.10339, -0.6264, 1.2747, -0.78668},
                                  {0.033038, 0.098498, -0.27307, 0.18138},
                                  {-0.0025909, 0.0012427, 0.00098746, -0.0020286}}}};

}  // namespace

const ReducedFunction& tissue_energy() noexcept {
  return kTissue;
}

InclusionFunctions inclusion_functions(double depth_mm) noexcept {
  // A parabola through the three depths that were computed.
  const double d = (std::clamp(depth_mm, 19.0, 31.0) - 25.0) / 6.0;
  const std::array<double, 3> shares{0.5 * d * (d - 1.0), 1.0 - d * d, 0.5 * d * (d + 1.0)};
  const auto mixed = [&](const ReducedFunction& near, const ReducedFunction& middle,
                         const ReducedFunction& far) {
    ReducedFunction all = middle;
    for (std::size_t k = 0; k < ReducedFunction::kPowers; ++k) {
      for (std::size_t m = 0; m < ReducedFunction::kTerms; ++m) {
        all.factors[k][m] =
            shares[0] * near.factors[k][m] + shares[1] * middle.factors[k][m] + shares[2] * far.factors[k][m];
      }
    }
    return all;
  };
  return {mixed(kExcess19, kExcess25, kExcess31), mixed(kAlong19, kAlong25, kAlong31),
          mixed(kAcross19, kAcross25, kAcross31)};
}

}  // namespace hapticd::sim
