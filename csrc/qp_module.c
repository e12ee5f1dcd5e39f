/*
 * The module hapticd.hqp._qp: the QP solver as a function of Python. It reads numpy's arrays where they lie,
 * as a call by way of cffi, with a view of each, takes longer than a small QP.
 */
#include <Python.h>

#include <limits.h>

#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <numpy/arrayobject.h>

#include "hqp_qp.h"

enum { P, Q, G, H, A, B, LB, UB, START, ARRAYS, ITERATIONS = ARRAYS, SECONDS, ARGUMENTS };
enum { KEPT = 8 }; /* as many threads find their memory again */

/* What a solve works in: for QPs of up to n variables and so many rows. */
typedef struct memory {
    hqp_qp_solver *solver;
    int n, rows;
} memory;

/* Memory that nobody works in. Who looks at it has the interpreter's lock. */
static memory idle[KEPT];
static int idle_count;

static int larger(int a, int b) {
    return a > b ? a : b;
}

static memory borrow(int n, int rows) {
    memory found = {NULL, 0, 0};
    if (idle_count) found = idle[--idle_count];
    if (n <= found.n && rows <= found.rows) return found;
    const memory grown = {NULL, larger(n, found.n), larger(rows, found.rows)};
    hqp_qp_destroy(found.solver);
    found = grown;
    found.solver = hqp_qp_create(found.n, found.rows);
    return found;
}

static void give_back(memory used) {
    if (used.solver && idle_count < KEPT) {
        idle[idle_count++] = used;
    } else {
        hqp_qp_destroy(used.solver);
    }
}

static int is_readable(PyObject *value) {
    if (!PyArray_CheckExact(value)) return 0;
    PyArrayObject *array = (PyArrayObject *)value;
    return PyArray_TYPE(array) == NPY_DOUBLE && PyArray_ISCARRAY_RO(array);
}

/* A contiguous array of doubles, or NULL with an exception. numpy takes long to see that there is nothing to
 * be done. */
static PyObject *readable(PyObject *value) {
    const int how = NPY_ARRAY_CARRAY_RO | NPY_ARRAY_ENSUREARRAY | NPY_ARRAY_FORCECAST;
    if (!is_readable(value)) return PyArray_FROMANY(value, NPY_DOUBLE, 0, 0, how);
    Py_INCREF(value);
    return value;
}

/* Where there is None, there is none. Returns 0 with an exception. */
static int take_arrays(PyObject *const *values, PyArrayObject **arrays) {
    for (int i = 0; i < ARRAYS; i++) {
        if (values[i] == Py_None) continue;
        arrays[i] = (PyArrayObject *)readable(values[i]);
        if (!arrays[i]) return 0;
    }
    return 1;
}

/* Entries of a vector and rows of a matrix; 0 of what has no dimension, or where there is none. */
static npy_intp length_of(PyArrayObject *array) {
    return array && PyArray_NDIM(array) ? PyArray_DIM(array, 0) : 0;
}

static int is_vector(PyArrayObject *array, npy_intp length) {
    return PyArray_NDIM(array) == 1 && PyArray_DIM(array, 0) == length;
}

static int is_matrix(PyArrayObject *array, npy_intp rows, npy_intp columns) {
    return PyArray_NDIM(array) == 2 && PyArray_DIM(array, 0) == rows && PyArray_DIM(array, 1) == columns;
}

/* Rows and their bounds, as many, or neither. */
static int are_rows(PyArrayObject *rows, PyArrayObject *bounds, npy_intp n) {
    if (!rows || !bounds) return rows == bounds;
    return is_vector(bounds, length_of(bounds)) && is_matrix(rows, length_of(bounds), n);
}

static int fit_together(PyArrayObject *const *a) {
    if (!a[P] || !a[Q]) return 0;
    const npy_intp n = length_of(a[Q]), rows = length_of(a[B]) + length_of(a[H]);
    if (n < 1 || n > INT_MAX || rows > INT_MAX) return 0;
    if (!is_vector(a[Q], n) || !is_matrix(a[P], n, n)) return 0;
    if (!are_rows(a[A], a[B], n) || !are_rows(a[G], a[H], n)) return 0;
    for (int i = LB; i <= START; i++) {
        if (a[i] && !is_vector(a[i], n)) return 0;
    }
    return 1;
}

static const double *entries(PyArrayObject *array) {
    return array ? PyArray_DATA(array) : NULL;
}

/* Returns 0 with an exception. */
static int take_limits(PyObject *const *arguments, hqp_qp *qp) {
    const long iterations = PyLong_AsLong(arguments[ITERATIONS]);
    qp->time_limit = PyFloat_AsDouble(arguments[SECONDS]);
    if (PyErr_Occurred()) return 0;
    if (iterations < 0 || iterations > INT_MAX) {
        PyErr_SetString(PyExc_ValueError, "max_iterations is out of range");
        return 0;
    }
    qp->max_iterations = (int)iterations;
    return 1;
}

static PyObject *result(hqp_qp_status status, PyObject *x, PyObject *multipliers, const hqp_qp_answer *found,
                        const hqp_qp *qp) {
    PyObject *parts[] = {PyLong_FromLong(status),
                         x,
                         multipliers,
                         PyLong_FromLong(found->iterations),
                         PyFloat_FromDouble(found->objective),
                         PyLong_FromLong(qp->equalities),
                         PyLong_FromLong(qp->inequalities)};
    enum { COUNT = sizeof parts / sizeof *parts };
    PyObject *tuple = PyTuple_New(COUNT);
    int is_whole = tuple != NULL;
    for (int i = 0; i < COUNT; i++) is_whole &= parts[i] != NULL;
    for (int i = 0; i < COUNT; i++) {
        if (is_whole) {
            PyTuple_SetItem(tuple, i, parts[i]);
        } else {
            Py_XDECREF(parts[i]);
        }
    }
    if (is_whole) return tuple;
    Py_XDECREF(tuple);
    return NULL;
}

static PyObject *solve_arrays(PyArrayObject *const *a, PyObject *const *arguments) {
    if (!fit_together(a)) {
        PyErr_SetString(PyExc_ValueError, "sizes do not fit");
        return NULL;
    }
    hqp_qp qp = {.n = (int)length_of(a[Q]),
                 .equalities = (int)length_of(a[B]),
                 .inequalities = (int)length_of(a[H]),
                 .P = entries(a[P]),
                 .q = entries(a[Q]),
                 .A = entries(a[A]),
                 .b = entries(a[B]),
                 .G = entries(a[G]),
                 .h = entries(a[H]),
                 .lb = entries(a[LB]),
                 .ub = entries(a[UB]),
                 .start = entries(a[START])};
    if (!take_limits(arguments, &qp)) return NULL;
    const memory used = borrow(qp.n, qp.equalities + qp.inequalities);
    if (!used.solver) {
        PyErr_SetString(PyExc_ValueError, "sizes are out of range");
        return NULL;
    }
    npy_intp n = qp.n, rows = (npy_intp)qp.equalities + qp.inequalities + n;
    PyObject *x = PyArray_SimpleNew(1, &n, NPY_DOUBLE),
             *multipliers = PyArray_SimpleNew(1, &rows, NPY_DOUBLE);
    if (!x || !multipliers) {
        give_back(used);
        Py_XDECREF(x);
        Py_XDECREF(multipliers);
        return NULL;
    }
    hqp_qp_answer found = {.x = PyArray_DATA((PyArrayObject *)x),
                           .multipliers = PyArray_DATA((PyArrayObject *)multipliers)};
    hqp_qp_status status;
    Py_BEGIN_ALLOW_THREADS status = hqp_qp_solve(used.solver, &qp, &found);
    Py_END_ALLOW_THREADS give_back(used);
    return result(status, x, multipliers, &found, &qp);
}

static PyObject *solve(PyObject *module, PyObject *const *arguments, Py_ssize_t count) {
    (void)module;
    if (count != ARGUMENTS) return PyErr_Format(PyExc_TypeError, "solve takes %d arguments", ARGUMENTS);
    PyArrayObject *arrays[ARRAYS] = {NULL};
    PyObject *answer = take_arrays(arguments, arrays) ? solve_arrays(arrays, arguments) : NULL;
    for (int i = 0; i < ARRAYS; i++) Py_XDECREF((PyObject *)arrays[i]);
    return answer;
}

static PyMethodDef functions[] = {
    {"solve", (PyCFunction)(void (*)(void))solve, METH_FASTCALL,
     "solve(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)\n--\n\n"
     "(status, x, multipliers, iterations, objective, equalities, inequalities); ValueError, TypeError or\n"
     "OverflowError where the arguments are no QP."},
    {NULL, NULL, 0, NULL}};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, .m_name = "_qp", .m_size = -1,
                                        .m_methods = functions};

PyMODINIT_FUNC PyInit__qp(void) {
    static const struct {
        const char *name;
        hqp_qp_status value;
    } statuses[] = {{"SOLVED", HQP_QP_SOLVED},         {"INFEASIBLE", HQP_QP_INFEASIBLE},
                    {"UNBOUNDED", HQP_QP_UNBOUNDED},   {"ITERATION_CAP", HQP_QP_ITERATION_CAP},
                    {"TIME_LIMIT", HQP_QP_TIME_LIMIT}, {"NOT_PROVEN", HQP_QP_NOT_PROVEN}};
    if (PyArray_ImportNumPyAPI() < 0) return NULL;
    PyObject *module = PyModule_Create(&definition);
    for (size_t i = 0; module && i < sizeof statuses / sizeof *statuses; i++) {
        if (PyModule_AddIntConstant(module, statuses[i].name, statuses[i].value) < 0) Py_CLEAR(module);
    }
    return module;
}
