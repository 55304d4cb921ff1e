// The same problem in Ceres, with automatic and with analytic derivatives. See ../run.sh.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <vector>

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Segment {
  double start, duration;
  double rotation[4];
  double position[3], rate[3], velocity[3];
};
struct Observation {
  double stamp, point[3], whitener[3], line;
};
struct Line {
  double anchor[3], axes[3][3];
};
struct Problem {
  double sheet[3][3], origin[3];
  double time_offset, rotation[4], translation[3];
  std::vector<Line> lines;
  std::vector<Segment> segments;
  std::vector<Observation> observations;
};

static Problem read(const char* file) {
  std::ifstream in(file, std::ios::binary);
  auto fill = [&in](void* to, size_t bytes) { in.read(static_cast<char*>(to), bytes); };
  double counts[3];
  fill(counts, sizeof counts);
  Problem p;
  fill(p.sheet, sizeof p.sheet);
  fill(p.origin, sizeof p.origin);
  fill(&p.time_offset, sizeof(double));
  fill(p.rotation, sizeof p.rotation);
  fill(p.translation, sizeof p.translation);
  p.lines.resize(static_cast<size_t>(counts[1]));
  p.segments.resize(static_cast<size_t>(counts[2]));
  p.observations.resize(static_cast<size_t>(counts[0]));
  fill(p.lines.data(), p.lines.size() * sizeof(Line));
  fill(p.segments.data(), p.segments.size() * sizeof(Segment));
  fill(p.observations.data(), p.observations.size() * sizeof(Observation));
  return p;
}

static double value(double x) { return x; }
template <typename T, int N>
static double value(const ceres::Jet<T, N>& x) { return x.a; }

// The segment that holds a time, from where the last search ended.
static const Segment& segment_at(const Problem& p, double time, int& hint) {
  const int last = static_cast<int>(p.segments.size()) - 1;
  while (hint < last && p.segments[hint + 1].start <= time) ++hint;
  while (hint > 0 && p.segments[hint].start > time) --hint;
  return p.segments[hint];
}

struct Sighting {
  const Problem& p;
  const Observation& o;
  mutable int hint;

  template <typename T>
  bool operator()(const T* offset, const T* turn, const T* shift, const T* line, T* residual) const {
    const Segment& s = segment_at(p, o.stamp - value(offset[0]), hint);
    const T elapsed = T(o.stamp - s.start) - offset[0];
    T rate[3], step[4], from[4], tool[4], delta[4], camera[4], start[4];
    for (int k = 0; k < 3; ++k) rate[k] = elapsed * s.rate[k];
    for (int k = 0; k < 4; ++k) {
      from[k] = T(s.rotation[k]);
      start[k] = T(p.rotation[k]);
    }
    ceres::AngleAxisToQuaternion(rate, step);
    ceres::QuaternionProduct(from, step, tool);
    ceres::AngleAxisToQuaternion(turn, delta);
    ceres::QuaternionProduct(delta, start, camera);
    T point[3] = {T(o.point[0]), T(o.point[1]), T(o.point[2])}, in_tool[3], in_base[3];
    ceres::UnitQuaternionRotatePoint(camera, point, in_tool);
    for (int k = 0; k < 3; ++k) in_tool[k] += T(p.translation[k]) + shift[k];
    ceres::UnitQuaternionRotatePoint(tool, in_tool, in_base);
    const Line& l = p.lines[static_cast<size_t>(o.line)];
    T bend[3], direction[3], first[3], off[3];
    for (int k = 0; k < 3; ++k) {
      bend[k] = line[0] * l.axes[1][k] + line[1] * l.axes[2][k];
      first[k] = T(l.axes[0][k]);
      off[k] = in_base[k] + T(s.position[k]) + elapsed * s.velocity[k] - T(l.anchor[k]) -
               line[2] * l.axes[1][k] - line[3] * l.axes[2][k];
    }
    ceres::AngleAxisRotatePoint(bend, first, direction);
    T both[4], axis[3][3];
    ceres::QuaternionProduct(tool, camera, both);
    for (int a = 0; a < 3; ++a) {
      T own[3] = {T(p.sheet[a][0]), T(p.sheet[a][1]), T(p.sheet[a][2])};
      ceres::UnitQuaternionRotatePoint(both, own, axis[a]);
    }
    const T along = ceres::DotProduct(axis[2], off) / ceres::DotProduct(axis[2], direction);
    for (int k = 0; k < 3; ++k) off[k] -= direction[k] * along;
    const T r1 = ceres::DotProduct(axis[0], off), r2 = ceres::DotProduct(axis[1], off);
    residual[0] = o.whitener[0] * r1;
    residual[1] = o.whitener[1] * r1 + o.whitener[2] * r2;
    return true;
  }
};

static Matrix3d hat(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

static Matrix3d left_jacobian(const Vector3d& w) {
  const double angle = w.norm();
  const Matrix3d h = hat(w);
  if (angle < 1e-4) return Matrix3d::Identity() + 0.5 * h + h * h / 6;
  return Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * h +
         (angle - std::sin(angle)) / (angle * angle * angle) * h * h;
}

static Quaterniond exponential(const Vector3d& w) {
  const double angle = w.norm();
  const double s = angle < 1e-6 ? 0.5 - angle * angle / 48 : std::sin(0.5 * angle) / angle;
  return Quaterniond(std::cos(0.5 * angle), s * w.x(), s * w.y(), s * w.z());
}

class Analytic : public ceres::SizedCostFunction<2, 1, 3, 3, 4> {
 public:
  Analytic(const Problem& p, const Observation& o) : p_(p), o_(o), hint_(0) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    using Row3 = Eigen::Matrix<double, 2, 3>;
    using Row4 = Eigen::Matrix<double, 2, 4>;
    const Segment& s = segment_at(p_, o_.stamp - x[0][0], hint_);
    const double elapsed = o_.stamp - s.start - x[0][0];
    const Vector3d rate(s.rate), velocity(s.velocity), turn(x[1]);
    const Quaterniond from(s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]);
    const Quaterniond start(p_.rotation[0], p_.rotation[1], p_.rotation[2], p_.rotation[3]);
    const Matrix3d tool = (from * exponential(rate * elapsed)).toRotationMatrix();
    const Matrix3d camera = (exponential(turn) * start).toRotationMatrix();
    const Vector3d mount = Vector3d(p_.translation) + Vector3d(x[2]);
    const Line& l = p_.lines[static_cast<size_t>(o_.line)];
    const Vector3d u1(l.axes[0]), u2(l.axes[1]), u3(l.axes[2]);
    const Vector3d bend = u2 * x[3][0] + u3 * x[3][1];
    const Vector3d direction = exponential(bend) * u1;
    const Vector3d anchor = Vector3d(l.anchor) + u2 * x[3][2] + u3 * x[3][3];
    const Vector3d point(o_.point);
    const Vector3d origin = Vector3d(s.position) + velocity * elapsed;
    const Vector3d off = tool * (camera * point + mount) + origin - anchor;
    Eigen::Matrix<double, 3, 2> axes;
    axes.col(0) = Vector3d(p_.sheet[0]);
    axes.col(1) = Vector3d(p_.sheet[1]);
    const Matrix3d both = tool * camera;
    const Vector3d normal = both * Vector3d(p_.sheet[2]);
    const Eigen::Matrix<double, 2, 3> in_sheet = (both * axes).transpose();
    const Row3 onto = in_sheet - (in_sheet * direction / normal.dot(direction)) * normal.transpose();
    const Eigen::Vector2d residual = onto * off;
    Eigen::Matrix2d whiten;
    whiten << o_.whitener[0], 0, o_.whitener[1], o_.whitener[2];
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = whiten * residual;
    if (jacobians == nullptr) return true;
    const Row3 w = whiten * onto;
    const Vector3d predicted = point - axes * residual;
    const Vector3d arm_camera = camera * predicted;
    const Vector3d lever = tool * (arm_camera + mount);
    if (jacobians[0]) {
      Eigen::Map<Eigen::Vector2d> j(jacobians[0]);
      j = w * (lever.cross(tool * rate) - velocity);
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[1]);
      j = -w * tool * hat(arm_camera) * left_jacobian(turn);
    }
    if (jacobians[2]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[2]);
      j = w * tool;
    }
    if (jacobians[3]) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> j(jacobians[3]);
      const Vector3d arm = lever + origin - anchor;
      const Matrix3d jl = left_jacobian(bend);
      Row4 columns;
      columns.col(0) = -w * (jl * u2).cross(arm);
      columns.col(1) = -w * (jl * u3).cross(arm);
      columns.col(2) = -w * u2;
      columns.col(3) = -w * u3;
      j = columns;
    }
    return true;
  }

 private:
  const Problem& p_;
  const Observation& o_;
  mutable int hint_;
};

static void run(const Problem& p, bool automatic, const char* name) {
  double best = 1e9;
  double offset[1], turn[3], shift[3];
  int iterations = 0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    std::vector<std::array<double, 4>> lines(p.lines.size(), std::array<double, 4>{});
    offset[0] = p.time_offset;
    std::memset(turn, 0, sizeof turn);
    std::memset(shift, 0, sizeof shift);
    ceres::Problem problem;
    for (const Observation& o : p.observations) {
      ceres::CostFunction* cost =
          automatic ? static_cast<ceres::CostFunction*>(
                          new ceres::AutoDiffCostFunction<Sighting, 2, 1, 3, 3, 4>(new Sighting{p, o, 0}))
                    : static_cast<ceres::CostFunction*>(new Analytic(p, o));
      problem.AddResidualBlock(cost, nullptr, offset, turn, shift, lines[static_cast<size_t>(o.line)].data());
    }
    // Every sighting's search begins where it belongs, as it does after the first evaluation.
    problem.Evaluate(ceres::Problem::EvaluateOptions(), nullptr, nullptr, nullptr, nullptr);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.num_threads = 1;
    // The start is good enough for full steps; with the default radius it takes eight instead of five.
    options.initial_trust_region_radius = 1e12;
    options.function_tolerance = 1e-17;
    options.gradient_tolerance = 0;
    options.parameter_tolerance = 1e-13;
    ceres::Solver::Summary summary;
    const auto began = std::chrono::steady_clock::now();
    ceres::Solve(options, &problem, &summary);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    best = std::min(best, took.count());
    iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
  }
  std::printf("{\"side\":\"%s\",\"found\":[%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g],\"iterations\":%d,\"seconds\":%.6e}\n",
              name, offset[0], turn[0], turn[1], turn[2], shift[0], shift[1], shift[2], iterations, best);
}

int main(int, char** arguments) {
  const Problem p = read(arguments[1]);
  run(p, true, "Ceres " CERES_VERSION_STRING ", automatic derivatives");
  run(p, false, "Ceres " CERES_VERSION_STRING ", analytic derivatives");
}
