/* What follows is the same for every safe set. Nothing is remembered between two calls, nothing is
 * allocated. First the guards that the theorem knows nothing of: they make nothing safe. */

typedef char NAME_literals_are_double[sizeof(1.0) == sizeof(double) ? 1 : -1];

#ifdef __clang__ /* which tells nothing of -fassociative-math and -fno-honor-nans: taken back here */
#pragma float_control(precise, on, push)
#endif

/* Are these numbers, and none infinite? Their bits are asked: an option may deny that NaN exist. */
static inline int NAME_finite(const double *x, int n)
{
    for (int i = 0; i < n; ++i) {
        union {
            double number;
            uint64_t bits;
        } seen;
        seen.number = x[i];
        if ((seen.bits >> 52 & 0x7ff) == 0x7ff)
            return 0;
    }
    return 1;
}

/* Does the processor round to nearest, and keep numbers so small that a program linked with
 * -ffast-math takes them for zero? It is asked, and not the compiler: hence volatile. */
static inline int NAME_as_ieee(void)
{
    const volatile double little = 0.75 * DBL_EPSILON;
    const volatile double least = DBL_MIN;
    const volatile double less = least * 0.5;
    return 1.0 + little > 1.0 && -1.0 - little < -1.0 && less > 0.0;
}

/* [m] How far the errors of one bin, interval and reference point reach against w. */
static inline double NAME_lost(const double *w, int bin, int t, int point)
{
#if NAME_N_BASES == 0
    double far = 0.0;
    for (int c = 0; c < NAME_N_P; ++c) {
        const double size = w[c] < 0.0 ? -w[c] : w[c];
        far += NAME_half[bin][t][point][c] * size;
    }
    return far;
#else
    double least = 0.0;
    for (int basis = 0; basis < NAME_N_BASES; ++basis) {
        double far = 0.0;
        for (int j = 0; j < NAME_N_P; ++j) {
            double mu = 0.0;
            for (int c = 0; c < NAME_N_P; ++c)
                mu += NAME_dual[bin][t][point][basis][j][c] * w[c];
            far -= NAME_centre[bin][t][point][basis][j] * mu;
            far += NAME_half[bin][t][point][basis][j] * (mu < 0.0 ? -mu : mu);
        }
        if (basis == 0 || far < least)
            least = far;
    }
    return least;
#endif
}

/* Does the direction of a run keep obstacle and part apart from knot t to knot t + 1? */
static inline int NAME_apart(const double *path, int bin, int run, int t)
{
    const double *w = NAME_run_w[run];
    for (int i = 0; i < NAME_N_PART; ++i) {
        const int point = NAME_pair_points[NAME_run_pair[run]][i];
        const double least = NAME_run_support[run] + NAME_lost(w, bin, t, point);
        const double *start = path + t * NAME_N_C + point * NAME_N_P;
        const double *end = start + NAME_N_C;
        double at_start = 0.0;
        double at_end = 0.0;
        for (int c = 0; c < NAME_N_P; ++c) {
            at_start += w[c] * start[c];
            at_end += w[c] * end[c];
        }
        if (!(at_start > least && at_end > least))
            return 0;
    }
    return 1;
}

/* Does a path keep to a corridor? First the intervals in which other plans leave it most often. */
static inline int NAME_keeps(const double *path, int bin, int corridor)
{
    for (int i = 0; i < NAME_N_PROBES; ++i) {
        const int *probe = NAME_probes[corridor][i];
        if (!NAME_apart(path, bin, probe[0], probe[1]))
            return 0;
    }
    for (int run = NAME_first_run[corridor]; run < NAME_first_run[corridor + 1]; ++run)
        for (int t = NAME_run_first[run]; t < NAME_run_end[run]; ++t)
            if (!NAME_apart(path, bin, run, t))
                return 0;
    return 1;
}

/* The bin of k, or -1: outside K, or on a border between two bins, where both errors count. */
static inline int NAME_bin(const double *k)
{
    int bin = 0;
    for (int j = 0; j < NAME_N_K; ++j) {
        const double *edge = NAME_edges + NAME_first_edge[j];
        const int n = NAME_first_edge[j + 1] - NAME_first_edge[j] - 1;
        int along = 0;
        if (!(edge[0] <= k[j] && k[j] <= edge[n]))
            return -1;
        while (along < n - 1 && k[j] >= edge[along + 1])
            ++along;
        if (along > 0 && k[j] == edge[along])
            return -1;
        bin = bin * n + along;
    }
    return bin;
}

/* Outputs of the network; only neurons that are not zero cost anything. */
static inline void NAME_network(const double *k, double *out)
{
    double value[NAME_WIDEST];
    double next[NAME_WIDEST];
    const double *weight = NAME_weights;
    const double *bias = NAME_biases;
    for (int j = 0; j < NAME_N_K; ++j)
        value[j] = k[j];
    for (int layer = 0; layer < NAME_N_LAYERS; ++layer) {
        const int n_in = NAME_widths[layer];
        const int n_out = NAME_widths[layer + 1];
        const int last = layer == NAME_N_LAYERS - 1;
        double *to = last ? out : next;
        for (int i = 0; i < n_out; ++i)
            to[i] = bias[i];
        for (int j = 0; j < n_in; ++j, weight += n_out) {
            if (value[j] == 0.0)
                continue;
            for (int i = 0; i < n_out; ++i)
                to[i] += weight[i] * value[j];
        }
        bias += n_out;
        if (!last)
            for (int i = 0; i < n_out; ++i)
                value[i] = next[i] > 0.0 ? next[i] : 0.0;
    }
}

/* 1: the plan (p0, k) keeps to a corridor, so it is safe, whatever the errors inside the tube;
 * tested in float64, with margins for its rounding. 0: nothing is known. p0 [m] is where the first
 * reference point starts. */
static inline int NAME_is_safe(const double p0[NAME_N_P], const double k[NAME_N_K])
{
    double path[(NAME_N_STEPS + 1) * NAME_N_C + NAME_N_Q];
    const double *end = path + NAME_N_STEPS * NAME_N_C;
    int bin = -1;
    if (NAME_as_ieee() && NAME_finite(p0, NAME_N_P) && NAME_finite(k, NAME_N_K))
        bin = NAME_bin(k);
    if (bin < 0)
        return 0;
    for (int c = 0; c < NAME_N_P; ++c) /* so that no sum below overflows */
        if (!(-NAME_far[c] <= p0[c] && p0[c] <= NAME_far[c]))
            return 0;
    for (int row = 0; row < NAME_N_START; ++row) {
        double value = 0.0;
        for (int c = 0; c < NAME_N_P; ++c)
            value += NAME_start_A[row][c] * p0[c];
        if (!(value <= NAME_start_b[row]))
            return 0;
    }
    for (int c = 0; c < NAME_N_P; ++c)
        path[c] = 0.0;
    NAME_network(k, path + NAME_N_P);
    for (int at = 0; at < (NAME_N_STEPS + 1) * NAME_N_C; ++at)
        path[at] += p0[at % NAME_N_P];
    for (int row = 0; row < NAME_N_GOAL; ++row) {
        double value = 0.0;
        for (int c = 0; c < NAME_N_C + NAME_N_Q; ++c)
            value += NAME_goal_A[row][c] * end[c];
        if (!(value <= NAME_goal_b[bin][row]))
            return 0;
    }
    for (int corridor = 0; corridor < NAME_N_CORRIDORS; ++corridor)
        if (NAME_keeps(path, bin, corridor))
            return 1;
    return 0;
}

/* Does a plan of the table lead from p0 to where the goal is? It only spares work. Where
 * something is measured, which takes the place of what the plan has there, every plan may. */
static inline int NAME_leads(const double p0[NAME_N_P], int plan)
{
    for (int c = 0; c < NAME_N_P && NAME_N_MEASURED == 0; ++c) {
        const double end = p0[c] + NAME_ends[plan][c];
        if (!(NAME_near[0][c] <= end && end <= NAME_near[1][c]))
            return 0;
    }
    return 1;
}

/* Writes to k a plan near the wanted one that NAME_is_safe lets pass from p0, where the robot is,
 * and returns 1; returns 0, and leaves k alone, where it knows none. Distances are shares of K.
 * What is measured at the start is so in wanted, and stays as it is there. */
static inline int NAME_nearest_plan(const double p0[NAME_N_P], const double wanted[NAME_N_K],
                                    double k[NAME_N_K])
{
    double least = 0.0;
    int nearest = NAME_N_PLANS;
    double safe[NAME_N_K];
    double middle[NAME_N_K];
    if (NAME_is_safe(p0, wanted)) {
        for (int j = 0; j < NAME_N_K; ++j)
            k[j] = wanted[j];
        return 1;
    }
    for (int plan = 0; plan < NAME_N_PLANS; ++plan) {
        double far = 0.0;
        if (!NAME_leads(p0, plan))
            continue;
        for (int j = 0; j < NAME_N_K; ++j) {
            const double *edge = NAME_edges + NAME_first_edge[j];
            const double range = NAME_edges[NAME_first_edge[j + 1] - 1] - edge[0];
            middle[j] = NAME_measured[j] ? wanted[j] : NAME_plans[plan][j];
            const double share = (middle[j] - wanted[j]) / range;
            far += share * share;
        }
        if ((nearest == NAME_N_PLANS || far < least) && NAME_is_safe(p0, middle)) {
            least = far;
            nearest = plan;
        }
    }
    if (nearest == NAME_N_PLANS)
        return 0;
    for (int j = 0; j < NAME_N_K; ++j)
        safe[j] = NAME_measured[j] ? wanted[j] : NAME_plans[nearest][j];
    for (double share = 0.5; share > 1e-4; share *= 0.5) { /* closer, as long as it is safe */
        for (int j = 0; j < NAME_N_K; ++j)
            middle[j] = safe[j] + share * (wanted[j] - safe[j]);
        if (NAME_is_safe(p0, middle))
            for (int j = 0; j < NAME_N_K; ++j)
                safe[j] = middle[j];
    }
    for (int j = 0; j < NAME_N_K; ++j)
        k[j] = safe[j];
    return 1;
}

#ifdef __clang__
#pragma float_control(pop)
#endif
