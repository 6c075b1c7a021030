"""
A try
=====

Maths :math:`\\sigma^2 = \\sum_{i \\ne 0} c_i^2` here.

.. math::

   \\begin{aligned} a &= \\frac{1}{2\\pi}\\int_{-1}^{1} T_k(x)\\,\\mathrm{d}x \\\\ b &= \\sqrt{x}\\end{aligned}
"""
import matplotlib.pyplot as plt
plt.plot([1,2])
print(1)
# %%
# More text.
print(2)
