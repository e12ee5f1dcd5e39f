/* The same source once more with another `real`, and other names: see hqp_extended.h. */
#ifndef HQP_NAMES_H
#define HQP_NAMES_H

/* A tenth slower and half the size. */
#if defined __GNUC__ && !defined __clang__
#pragma GCC optimize("Os")
#endif

#define HQP_EXTENDED
#define hqp_solver hqp_extended
#define hqp_any_joined hqp_extended_any_joined
#define hqp_any_strict hqp_extended_any_strict
#define hqp_bring hqp_extended_bring
#define hqp_bring_back hqp_extended_bring_back
#define hqp_choose hqp_extended_choose
#define hqp_close_gaps hqp_extended_close_gaps
#define hqp_close_level hqp_extended_close_level
#define hqp_confirm hqp_extended_confirm
#define hqp_copy_base hqp_extended_copy_base
#define hqp_create hqp_extended_create
#define hqp_default_settings hqp_extended_default_settings
#define hqp_descent hqp_extended_descent
#define hqp_destroy hqp_extended_destroy
#define hqp_end_here hqp_extended_end_here
#define hqp_factorise hqp_extended_factorise
#define hqp_find_multipliers hqp_extended_find_multipliers
#define hqp_find_slacks hqp_extended_find_slacks
#define hqp_find_step hqp_extended_find_step
#define hqp_find_values hqp_extended_find_values
#define hqp_finish hqp_extended_finish
#define hqp_first_apart hqp_extended_first_apart
#define hqp_fit_face hqp_extended_fit_face
#define hqp_fix hqp_extended_fix
#define hqp_forget hqp_extended_forget
#define hqp_forget_reflectors hqp_extended_forget_reflectors
#define hqp_forget_row hqp_extended_forget_row
#define hqp_free_directions hqp_extended_free_directions
#define hqp_freeze hqp_extended_freeze
#define hqp_gather hqp_extended_gather
#define hqp_give_way hqp_extended_give_way
#define hqp_go_to hqp_extended_go_to
#define hqp_gradient hqp_extended_gradient
#define hqp_guess hqp_extended_guess
#define hqp_harden hqp_extended_harden
#define hqp_has_slack hqp_extended_has_slack
#define hqp_hold hqp_extended_hold
#define hqp_hold_broken hqp_extended_hold_broken
#define hqp_hold_fitted hqp_extended_hold_fitted
#define hqp_holds_joined hqp_extended_holds_joined
#define hqp_is_clear hqp_extended_is_clear
#define hqp_is_kept_better hqp_extended_is_kept_better
#define hqp_is_long hqp_extended_is_long
#define hqp_is_minimal hqp_extended_is_minimal
#define hqp_is_worth_joins hqp_extended_is_worth_joins
#define hqp_join hqp_extended_join
#define hqp_join_next hqp_extended_join_next
#define hqp_keep hqp_extended_keep
#define hqp_last_missed hqp_extended_last_missed
#define hqp_least_squares hqp_extended_least_squares
#define hqp_leave_unseen hqp_extended_leave_unseen
#define hqp_lq hqp_extended_lq
#define hqp_may_gain hqp_extended_may_gain
#define hqp_most_broken hqp_extended_most_broken
#define hqp_move_to_trial hqp_extended_move_to_trial
#define hqp_noise hqp_extended_noise
#define hqp_out_of_iterations hqp_extended_out_of_iterations
#define hqp_part hqp_extended_part
#define hqp_part_last hqp_extended_part_last
#define hqp_prove hqp_extended_prove
#define hqp_prove_by_descent hqp_extended_prove_by_descent
#define hqp_reflect_all hqp_extended_reflect_all
#define hqp_reflect_back hqp_extended_reflect_back
#define hqp_reflect_row hqp_extended_reflect_row
#define hqp_reflect_row_back hqp_extended_reflect_row_back
#define hqp_reset hqp_extended_reset
#define hqp_resolve hqp_extended_resolve
#define hqp_rewind hqp_extended_rewind
#define hqp_scatter hqp_extended_scatter
#define hqp_seat_guess hqp_extended_seat_guess
#define hqp_seat_held hqp_extended_seat_held
#define hqp_seat_missed hqp_extended_seat_missed
#define hqp_seat_violated hqp_extended_seat_violated
#define hqp_set_apart hqp_extended_set_apart
#define hqp_soften hqp_extended_soften
#define hqp_solve hqp_extended_solve
#define hqp_solve_from hqp_extended_solve_from
#define hqp_start hqp_extended_start
#define hqp_status_name hqp_extended_status_name
#define hqp_sweep hqp_extended_sweep
#define hqp_take_back hqp_extended_take_back
#define hqp_take_into_held hqp_extended_take_into_held
#define hqp_take_up hqp_extended_take_up
#define hqp_touches hqp_extended_touches
#define hqp_touches_with hqp_extended_touches_with
#define hqp_try_join hqp_extended_try_join
#define hqp_unfix hqp_extended_unfix
#define hqp_unjoin hqp_extended_unjoin
#define hqp_usual hqp_extended_usual
#define hqp_version hqp_extended_version
#define hqp_walk hqp_extended_walk
#define hqp_weigh hqp_extended_weigh

#endif
