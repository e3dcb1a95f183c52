#include "tests/measure/study/tumour/body/soft_body.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::study {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPenaltyNPerMm3 = 0.4;  // of the contact: some hundredths of a millimetre deep
constexpr double kRimRad = 1.05;         // of the top face of the box that is mapped to the body
constexpr double kGrading = 1.2;
constexpr double kTolerance = 1e-6;
constexpr int kMaxNewton = 30;

Eigen::Matrix<double, 8, 1> shape_of(const Vector3d& x) {
  Eigen::Matrix<double, 8, 1> n;
  for (int a = 0; a < 8; ++a) {
    const double sx = (a & 1) ? 1.0 : -1.0, sy = (a & 2) ? 1.0 : -1.0, sz = (a & 4) ? 1.0 : -1.0;
    n[a] = 0.125 * (1 + sx * x[0]) * (1 + sy * x[1]) * (1 + sz * x[2]);
  }
  return n;
}

Eigen::Matrix<double, 3, 8> slope_of(const Vector3d& x) {
  Eigen::Matrix<double, 3, 8> d;
  for (int a = 0; a < 8; ++a) {
    const double sx = (a & 1) ? 1.0 : -1.0, sy = (a & 2) ? 1.0 : -1.0, sz = (a & 4) ? 1.0 : -1.0;
    d(0, a) = 0.125 * sx * (1 + sy * x[1]) * (1 + sz * x[2]);
    d(1, a) = 0.125 * sy * (1 + sx * x[0]) * (1 + sz * x[2]);
    d(2, a) = 0.125 * sz * (1 + sx * x[0]) * (1 + sy * x[1]);
  }
  return d;
}

}  // namespace

SoftBody::SoftBody(const SoftBodyParameters& parameters) : p_(parameters) {
  mesh();
  reset();
}

void SoftBody::reset() {
  u_ = Vector::Zero(static_cast<Eigen::Index>(free_count_));
  before_ = u_;
  ball_ = ball_before_ = {0.0, 0.0, p_.radius_mm + p_.tip_radius_mm + 1.0};
}

// A box of rays from the base's centre, its outside on the sphere.
void SoftBody::mesh() {
  const int n = p_.layers;
  const int across = 2 * n;
  const auto index = [&](int i, int j, int k) { return (k * (n + 1) + j) * (across + 1) + i; };
  nodes_.resize(static_cast<std::size_t>((across + 1) * (n + 1) * (n + 1)));
  unknown_.resize(nodes_.size());
  int count = 0;
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= across; ++i) {
        // Even across; finer towards the surface.
        const Vector3d box{static_cast<double>(i - n) / n, static_cast<double>(j) / n,
                           1.0 - std::pow(static_cast<double>(n - k) / n, kGrading)};
        const double far = box.cwiseAbs().maxCoeff();
        // Rays at even angles, as far as the rim of the box.
        const auto part = [&](double coordinate) { return far > 0.0 ? coordinate / far : 0.0; };
        const Vector3d ray{std::tan(kRimRad * part(box[0])), std::tan(kRimRad * part(box[1])), part(box[2])};
        const double length = ray.norm();
        const auto node = static_cast<std::size_t>(index(i, j, k));
        nodes_[node] = length > 0.0 ? Vector3d(ray * (p_.radius_mm * far / length)) : Vector3d::Zero();
        for (int axis = 0; axis < 3; ++axis) {
          const bool held = k == 0 || (axis == 1 && j == 0);
          unknown_[node][static_cast<std::size_t>(axis)] = held ? -1 : count++;
        }
      }
    }
  }
  free_count_ = static_cast<std::size_t>(count);

  const double g = 1.0 / std::sqrt(3.0);
  const Vector3d centre{0.0, 0.0, p_.radius_mm - p_.inclusion_depth_mm};
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < across; ++i) {
        Element e;
        Eigen::Matrix<double, 8, 3> at;
        for (int a = 0; a < 8; ++a) {
          e.nodes[static_cast<std::size_t>(a)] = index(i + (a & 1), j + ((a >> 1) & 1), k + ((a >> 2) & 1));
          at.row(a) = nodes_[static_cast<std::size_t>(e.nodes[static_cast<std::size_t>(a)])];
        }
        for (int q = 0; q < 8; ++q) {
          const Vector3d x{(q & 1) ? g : -g, (q & 2) ? g : -g, (q & 4) ? g : -g};
          Point& point = e.points[static_cast<std::size_t>(q)];
          const Eigen::Matrix<double, 3, 8> slope = slope_of(x);
          const Matrix3d jacobian = slope * at;
          point.weight = jacobian.determinant();
          point.gradient = jacobian.inverse() * slope;
          point.shape = shape_of(x);
          const Vector3d place = at.transpose() * point.shape;
          point.in_inclusion = (place - centre).norm() < p_.inclusion_radius_mm;
          // Smeared over the share of the point's own eighth that is inside, on a grid of 4³.
          int inside = 0;
          for (int s = 0; s < 64; ++s) {
            const auto part = [&](int bit, int t) {
              return 0.5 * ((q & bit) ? 1.0 : -1.0) + (t + 0.5) / 4.0 - 0.5;
            };
            const Vector3d local{part(1, s & 3), part(2, (s >> 2) & 3), part(4, s >> 4)};
            inside += (Vector3d(at.transpose() * shape_of(local)) - centre).norm() < p_.inclusion_radius_mm;
          }
          // Between the bounds of Voigt and Reuss: in equal ratios.
          point.factor = std::pow(p_.inclusion_factor, inside / 64.0);
          e.volume += point.weight;
        }
        elements_.push_back(e);
      }
    }
  }
  // The ball touches the top faces only.
  constexpr int kSub = 4;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < across; ++i) {
      const std::array<int, 4> quad{index(i, j, n), index(i + 1, j, n), index(i, j + 1, n),
                                    index(i + 1, j + 1, n)};
      for (int s = 0; s < kSub * kSub; ++s) {
        const double x = (s % kSub + 0.5) / kSub, y = (s / kSub + 0.5) / kSub;
        SurfacePoint point;
        point.nodes = quad;
        point.shape = {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y};
        const auto node = [&](std::size_t a) { return nodes_[static_cast<std::size_t>(quad[a])]; };
        const Vector3d dx = (node(1) - node(0)) * (1 - y) + (node(3) - node(2)) * y;
        const Vector3d dy = (node(2) - node(0)) * (1 - x) + (node(3) - node(1)) * x;
        point.area_mm2 = dx.cross(dy).norm() / (kSub * kSub);
        point.place_mm.setZero();
        for (std::size_t a = 0; a < 4; ++a) point.place_mm += point.shape[a] * node(a);
        point.place_mm *= p_.radius_mm / point.place_mm.norm();
        surface_.push_back(point);
      }
    }
  }
}

double SoftBody::evaluate(const Vector& u, Vector* gradient, Eigen::SparseMatrix<double>* stiffness) const {
  const double bulk = p_.bulk_ratio * 2.0 * p_.yeoh_n_per_mm2[0];
  double energy = 0.0;
  std::vector<Eigen::Triplet<double>> triplets;
  if (gradient != nullptr) gradient->setZero(u.size());
  if (stiffness != nullptr) triplets.reserve(elements_.size() * 300);
  const auto moved = [&](int node) {
    Vector3d d = Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const int i = unknown_[static_cast<std::size_t>(node)][static_cast<std::size_t>(axis)];
      if (i >= 0) d[axis] = u[i];
    }
    return d;
  };
  for (const Element& e : elements_) {
    Eigen::Matrix<double, 3, 8> d;
    for (int a = 0; a < 8; ++a) d.col(a) = moved(e.nodes[static_cast<std::size_t>(a)]);
    Eigen::Matrix<double, 24, 1> force = Eigen::Matrix<double, 24, 1>::Zero();
    Eigen::Matrix<double, 24, 1> volume_slope = Eigen::Matrix<double, 24, 1>::Zero();
    Eigen::Matrix<double, 24, 24> matrix;
    if (stiffness != nullptr) matrix.setZero();
    std::array<double, 8> jacobians{};
    std::array<Eigen::Matrix<double, 3, 8>, 8> spatial;
    double mean = 0.0;
    for (std::size_t q = 0; q < 8; ++q) {
      const Point& point = e.points[q];
      const Matrix3d f = Matrix3d::Identity() + d * point.gradient.transpose();
      const double j = f.determinant();
      if (!(j > 1e-3)) return std::numeric_limits<double>::infinity();
      jacobians[q] = j;
      mean += point.weight * j;
      const Matrix3d inverse_t = f.inverse().transpose();
      const double strain = f.squaredNorm() - 3.0 - 2.0 * std::log(j);
      const auto& c = p_.yeoh_n_per_mm2;
      const double w = point.weight * point.factor;
      energy += w * strain * (c[0] + strain * (c[1] + strain * c[2]));
      if (gradient == nullptr) continue;
      spatial[q] = inverse_t * point.gradient;
      const double first = w * (c[0] + strain * (2.0 * c[1] + 3.0 * strain * c[2]));
      const double second = w * (2.0 * c[1] + 6.0 * strain * c[2]);
      const Eigen::Matrix<double, 3, 8> p = 2.0 * (f * point.gradient - spatial[q]);
      const Eigen::Map<const Eigen::Matrix<double, 24, 1>> flat(p.data());
      force += first * flat;
      const Eigen::Map<const Eigen::Matrix<double, 24, 1>> spatial_flat(spatial[q].data());
      volume_slope += point.weight * j * spatial_flat;
      if (stiffness == nullptr) continue;
      matrix.noalias() += second * flat * flat.transpose();
      const Eigen::Matrix<double, 8, 8> plain = 2.0 * first * point.gradient.transpose() * point.gradient;
      for (int a = 0; a < 8; ++a) {
        for (int b = 0; b < 8; ++b) {
          matrix.block<3, 3>(3 * a, 3 * b) += plain(a, b) * Matrix3d::Identity() +
                                              2.0 * first * spatial[q].col(b) * spatial[q].col(a).transpose();
        }
      }
    }
    const double excess = mean / e.volume - 1.0;
    energy += 0.5 * bulk * e.volume * excess * excess;
    if (gradient == nullptr) continue;
    force += bulk * excess * volume_slope;
    std::array<int, 24> at{};
    for (std::size_t a = 0; a < 8; ++a) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        at[3 * a + axis] = unknown_[static_cast<std::size_t>(e.nodes[a])][axis];
    }
    for (std::size_t i = 0; i < 24; ++i) {
      if (at[i] >= 0) (*gradient)[at[i]] += force[static_cast<Eigen::Index>(i)];
    }
    if (stiffness == nullptr) continue;
    matrix.noalias() += bulk / e.volume * volume_slope * volume_slope.transpose();
    for (std::size_t q = 0; q < 8; ++q) {
      const double w = bulk * excess * e.points[q].weight * jacobians[q];
      for (int a = 0; a < 8; ++a) {
        for (int b = 0; b < 8; ++b) {
          matrix.block<3, 3>(3 * a, 3 * b) += w * (spatial[q].col(a) * spatial[q].col(b).transpose() -
                                                   spatial[q].col(b) * spatial[q].col(a).transpose());
        }
      }
    }
    for (std::size_t i = 0; i < 24; ++i) {
      for (std::size_t j = 0; j < 24; ++j) {
        if (at[i] >= 0 && at[j] >= 0 && at[i] >= at[j])
          triplets.emplace_back(at[i], at[j],
                                matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
      }
    }
  }
  for (const SurfacePoint& s : surface_) {
    Vector3d x = s.place_mm;
    for (std::size_t a = 0; a < 4; ++a) x += s.shape[a] * moved(s.nodes[a]);
    const Vector3d out = x - ball_;
    const double distance = out.norm();
    const double gap = distance - p_.tip_radius_mm;
    if (gap >= 0.0) continue;
    const double k = kPenaltyNPerMm3 * s.area_mm2;
    energy += 0.5 * k * gap * gap;
    if (gradient == nullptr) continue;
    const Vector3d n = out / distance;
    const Matrix3d h = k * (n * n.transpose() + gap / distance * (Matrix3d::Identity() - n * n.transpose()));
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t i = 0; i < 3; ++i) {
        const int row = unknown_[static_cast<std::size_t>(s.nodes[a])][i];
        if (row < 0) continue;
        (*gradient)[row] += s.shape[a] * k * gap * n[static_cast<Eigen::Index>(i)];
        if (stiffness == nullptr) continue;
        for (std::size_t b = 0; b < 4; ++b) {
          for (std::size_t j = 0; j < 3; ++j) {
            const int column = unknown_[static_cast<std::size_t>(s.nodes[b])][j];
            if (column >= 0 && row >= column) {
              triplets.emplace_back(
                  row, column,
                  s.shape[a] * s.shape[b] * h(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
            }
          }
        }
      }
    }
  }
  if (stiffness != nullptr) {
    stiffness->resize(u.size(), u.size());
    stiffness->setFromTriplets(triplets.begin(), triplets.end());
  }
  return energy;
}

// Conjugate gradients with the older factor; a new factor if they take too long.
bool SoftBody::solve(const Eigen::SparseMatrix<double>& stiffness, const Vector& gradient, Vector& step) {
  constexpr int kMaxIterations = 40;
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (!has_factor_ || attempt == 1) {
      if (!analysed_) {
        factor_.analyzePattern(stiffness);
        analysed_ = true;
      }
      factor_.factorize(stiffness);
      has_factor_ = factor_.info() == Eigen::Success;
      if (!has_factor_) return false;
    }
    step = Vector::Zero(gradient.size());
    Vector r = -gradient;
    Vector z = factor_.solve(r);
    Vector p = z;
    double rz = r.dot(z);
    const double enough = 1e-4 * gradient.norm();
    const auto full = stiffness.selfadjointView<Eigen::Lower>();
    for (int i = 0; i < kMaxIterations; ++i) {
      const Vector kp = full * p;
      const double curvature = p.dot(kp);
      if (!(curvature > 0.0)) break;
      const double alpha = rz / curvature;
      step += alpha * p;
      r -= alpha * kp;
      if (r.norm() < enough) return true;
      z = factor_.solve(r);
      const double next = r.dot(z);
      p = z + next / rz * p;
      rz = next;
    }
    if (attempt == 1 && step.dot(gradient) < 0.0) return true;
  }
  return false;
}

bool SoftBody::balance() {
  Vector gradient;
  Eigen::SparseMatrix<double> stiffness;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    const double energy = evaluate(u_, &gradient, &stiffness);
    const SoftBodyState now = state();
    residual_ = gradient.norm() / std::max(1e-2, now.force_n.norm());
    if (residual_ < kTolerance) return true;
    Vector step;
    if (!solve(stiffness, gradient, step)) {
      has_factor_ = false;
      step = -gradient;
    }
    double share = 1.0;
    const double slope = gradient.dot(step);
    while (share > 1e-6 && !(evaluate(u_ + share * step, nullptr, nullptr) <=
                             energy + 1e-4 * share * slope + 1e-12 * std::abs(energy))) {
      share *= 0.5;
    }
    if (share <= 1e-6) return residual_ < 1e-3;
    u_ += share * step;
  }
  return residual_ < 1e-3;
}

bool SoftBody::press(const Vector3d& centre_mm) {
  const Vector u = u_;
  const Vector3d from = ball_;
  for (const int parts : {1, 2, 4}) {
    u_ = u;
    bool found = true;
    for (int i = 1; i <= parts && found; ++i) {
      ball_ = from + (centre_mm - from) * (static_cast<double>(i) / parts);
      found = balance();
    }
    if (found) return true;
  }
  return false;
}

SoftBodyState SoftBody::state() const {
  SoftBodyState s;
  s.energy_n_mm = 2.0 * evaluate(u_, nullptr, nullptr);
  s.force_n.setZero();
  s.inclusion_mm.setZero();
  s.residual = residual_;
  const auto moved = [&](int node, Eigen::Index axis) {
    const int i = unknown_[static_cast<std::size_t>(node)][static_cast<std::size_t>(axis)];
    return i >= 0 ? u_[i] : 0.0;
  };
  for (const SurfacePoint& p : surface_) {
    Vector3d x = p.place_mm;
    for (std::size_t a = 0; a < 4; ++a) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) x[axis] += p.shape[a] * moved(p.nodes[a], axis);
    }
    const Vector3d out = x - ball_;
    const double gap = out.norm() - p_.tip_radius_mm;
    if (gap < 0.0) s.force_n += 2.0 * kPenaltyNPerMm3 * p.area_mm2 * gap * out.normalized();
  }
  s.force_n[1] = 0.0;
  double weight = 0.0;
  for (const Element& e : elements_) {
    for (const Point& point : e.points) {
      if (!point.in_inclusion) continue;
      weight += point.weight;
      for (std::size_t a = 0; a < 8; ++a) {
        for (Eigen::Index axis = 0; axis < 3; ++axis)
          s.inclusion_mm[axis] +=
              point.weight * point.shape[static_cast<Eigen::Index>(a)] * moved(e.nodes[a], axis);
      }
    }
  }
  if (weight > 0.0) s.inclusion_mm /= weight;
  s.inclusion_mm[1] = 0.0;
  return s;
}

}  // namespace hapticd::study
