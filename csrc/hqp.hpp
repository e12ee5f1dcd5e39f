// hqp.h for C++ and Eigen: the same problem, solver and statuses, with the memory looked after.
//
//     hqp::Level task;
//     task.A = ..., task.b = ...;                       // any Eigen expression; absent parts stay empty
//     hqp::Solver solver(n, {{0, 2}, {1, 0}});          // per level: equalities, inequalities
//     const hqp::Solution &found = solver.solve({limits, task});
#ifndef HQP_HPP
#define HQP_HPP

#include <Eigen/Core>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

extern "C" {
#include "hqp.h"
}

namespace hqp {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

/// A x + w = b, lb <= C x + v <= ub; weights of the rows of A, then of C, or empty: all 1.
struct Level {
    Matrix A, C;
    Vector b, lb, ub, weights;
};

struct Solution {
    Vector x, w, v; ///< slacks of all levels one after the other
    hqp_status status = HQP_SOLVED;
    int iterations = 0, levels_done = 0, rank = 0, bad_level = -1;
};

class Solver {
  public:
    using Rows = std::vector<std::pair<int, int>>;

    /// Throws std::invalid_argument where a size or a setting is out of range. The only call that allocates.
    Solver(int n, const Rows &rows, const hqp_settings &settings = hqp_default_settings())
        : n_(n), rows_(rows), given_(rows.size()) {
        std::vector<int> equalities, inequalities;
        Eigen::Index w = 0, v = 0;
        for (const auto &[eq, ineq] : rows) {
            equalities.push_back(eq), inequalities.push_back(ineq);
            w += eq, v += ineq;
        }
        const hqp_dims dims = {n, static_cast<int>(rows.size()), equalities.data(), inequalities.data()};
        solver_.reset(hqp_create(&dims, &settings));
        if (!solver_) throw std::invalid_argument("hqp: a size or a setting is out of range");
        found_.x.setZero(n), found_.w.setZero(w), found_.v.setZero(v);
    }

    /// Solve, starting from the last solution. Throws std::invalid_argument where a size does not fit.
    const Solution &solve(const std::vector<Level> &levels, int first_changed_level = 0) {
        if (levels.size() != rows_.size()) throw std::invalid_argument("hqp: another number of levels");
        for (std::size_t p = 0; p < levels.size(); p++) given_[p] = checked(levels[p], rows_[p]);
        hqp_info info{};
        info.w = found_.w.data(), info.v = found_.v.data();
        found_.status =
            hqp_resolve(solver_.get(), given_.data(), first_changed_level, found_.x.data(), &info);
        found_.iterations = info.iterations, found_.levels_done = info.levels_done;
        found_.rank = info.rank, found_.bad_level = info.bad_level;
        return found_;
    }

    /// The next solve starts from x; false where it is not finite.
    bool start(const Vector &x) { return x.size() == n_ && hqp_start(solver_.get(), x.data()); }
    void reset() { hqp_reset(solver_.get()); }

  private:
    hqp_level checked(const Level &level, const std::pair<int, int> &rows) const {
        const auto [eq, ineq] = rows;
        const bool fits = level.b.size() == eq && level.A.rows() == eq && (eq == 0 || level.A.cols() == n_) &&
                          level.lb.size() == ineq && level.ub.size() == ineq && level.C.rows() == ineq &&
                          (ineq == 0 || level.C.cols() == n_) &&
                          (level.weights.size() == 0 || level.weights.size() == eq + ineq);
        if (!fits) throw std::invalid_argument("hqp: a level of another shape than the solver was made for");
        return {level.A.data(),  level.b.data(),  level.C.data(),
                level.lb.data(), level.ub.data(), level.weights.size() ? level.weights.data() : nullptr};
    }

    struct Destroy {
        void operator()(hqp_solver *solver) const { hqp_destroy(solver); }
    };
    int n_;
    Rows rows_;
    std::vector<hqp_level> given_;
    std::unique_ptr<hqp_solver, Destroy> solver_;
    Solution found_;
};

} // namespace hqp

#endif
