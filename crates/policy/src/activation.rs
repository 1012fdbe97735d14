//! Activation functions on slices, written so that the compiler vectorizes them.

/// `x` above zero, `exp(x) − 1` below, in place.
///
/// max(x, 0) + (exp(min(x, 0)) − 1): no branch, and no infinity from a finite input. NaN gives 0, so what comes out says nothing of
/// whether the weights before it are numbers.
#[inline]
pub fn elu_in_place(values: &mut [f32]) {
    for x in values {
        *x = x.max(0.0) + exp_nonpositive(x.min(0.0)) - 1.0;
    }
}

/// Derivative of ELU from its value: 1 above zero, `y + 1` below.
#[inline]
pub fn elu_slope(y: f32) -> f32 {
    y.min(0.0) + 1.0
}

/// `exp(x)` for `x ≤ 0`, relative error below 3e-7; 0 from about −87 down.
///
/// x = n ln 2 + r with |r| ≤ ln 2 / 2 (Cody and Waite's two-part ln 2), a polynomial of degree 6 for exp(r), and n added
/// to the exponent bits.
#[inline(always)]
fn exp_nonpositive(x: f32) -> f32 {
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    /// 1.5 · 2²³: adding it leaves the nearest whole number in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.max(-87.0);
    let shifted = x.mul_add(std::f32::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = n.mul_add(-LN2_LOW, n.mul_add(-LN2_HIGH, x));
    let p = 1.0 / 720.0;
    let p = r.mul_add(p, 1.0 / 120.0);
    let p = r.mul_add(p, 1.0 / 24.0);
    let p = r.mul_add(p, 1.0 / 6.0);
    let p = r.mul_add(p, 0.5);
    let p = r.mul_add(p, 1.0);
    let p = r.mul_add(p, 1.0);
    // The low bits of `shifted` hold n; shifting them to the exponent's place multiplies by 2ⁿ.
    f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_is_accurate() {
        for i in 0..200_000 {
            let x = -86.0 * i as f32 / 200_000.0;
            let expected = f64::from(x).exp();
            let relative = (f64::from(exp_nonpositive(x)) / expected - 1.0).abs();
            assert!(relative < 3e-7, "exp({x}) off by {relative:e}");
        }
    }

    #[test]
    fn elu_is_finite_everywhere_and_exact_where_it_is_linear() {
        let mut values = [0.0, 1.5, 88.0, 1e30, -0.5, -88.0, -1e30, f32::MAX, f32::MIN];
        elu_in_place(&mut values);
        assert_eq!(values[..4], [0.0, 1.5, 88.0, 1e30]);
        assert!((values[4] - ((-0.5_f32).exp() - 1.0)).abs() < 1e-7);
        assert_eq!(values[5], -1.0);
        assert!(values.iter().all(|value| value.is_finite()));
        let mut none = [f32::NAN];
        elu_in_place(&mut none);
        assert_eq!(none, [0.0]);
    }

    #[test]
    fn slope_is_the_derivative() {
        for x in [-3.0_f32, -0.2, 0.3, 2.0] {
            let mut y = [x - 1e-3, x, x + 1e-3];
            elu_in_place(&mut y);
            let difference = (y[2] - y[0]) / 2e-3;
            assert!((elu_slope(y[1]) - difference).abs() < 1e-3);
        }
    }
}
